"""A strip of vulcanized rubber is pulled to twice and to six times its length. Ogden (1972) fitted Treloar's (1944)
data with three terms, mu = 0.63, 0.0012 and -0.01 MPa and alpha = 1.3, 5 and -2; the nominal stress of an
incompressible strip follows in closed form. Treloar measured 0.53 MPa at 2.0 and 2.55 MPa at 6.0, interpolated in
examples/rubber.
"""

import numpy as np
from tests.published.case import Case, Reference, Solution, equilibria, mapped_box, rollers, triangles_where

import supple as sp

TERMS = np.array([(0.63e6, 1.3), (0.0012e6, 5.0), (-0.01e6, -2.0)])
STRETCHES = (2.0, 6.0)


def nominal(stretch):
    """Ogden (1972): the sum of mu (s^(alpha - 1) - s^(-alpha / 2 - 1)) [MPa]."""
    mu, alpha = TERMS.T
    return float((mu * (stretch ** (alpha - 1) - stretch ** (-alpha / 2 - 1))).sum() / 1e6)


def solve(cells):
    mesh = mapped_box((2 * cells, cells, cells), lambda x: x * (2.0, 1.0, 1.0))
    x = mesh.vertices
    law = sp.Ogden(mu=TERMS[:, 0], alpha=TERMS[:, 1], bulk=1e9)
    end = x[:, 0] > 2 - 1e-9
    loads = (0, 0.3, nominal(2.0), 0.8, 1.1, 1.7, nominal(6.0))
    pull = sp.Curve(np.arange(7) / 6, [(1e6 * load, 0, 0) for load in loads])
    scene = sp.Scene(
        [sp.Body("strip", mesh, law)],
        soft_targets=[rollers("strip", mesh, axis, x[:, axis] < 1e-9, 1e6) for axis in range(3)],
        loads=[sp.Traction("strip", pull, triangles_where(mesh, end))],
        gravity=(0, 0, 0),
    )
    frames = equilibria(scene, 12)
    values = [frames[k].positions["strip"][end, 0].mean() / 2 for k in (3, 11)]
    return Solution({f"stretch at {nominal(s):.4f} MPa": v for s, v in zip(STRETCHES, values, strict=True)}, frames[-1])


CASE = Case(
    title="Rubber strip with Ogden's constants",
    source="Ogden 1972",
    references={f"stretch at {nominal(s):.4f} MPa": Reference(s, "1") for s in STRETCHES},
    solve=solve,
    meshes=(1, 2),
    differs="The bulk modulus is 1 GPa, the closed form has no change of volume.",
)
