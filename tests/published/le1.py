"""A quarter of an elliptic membrane with an elliptic hole, 0.1 m thick, in plane stress: semi-axes 2 and 1 m inside,
3.25 and 2.75 m outside. A tension of 10 MPa acts normal to the outer edge; E = 210 GPa and Poisson's ratio is 0.3.
NAFEMS (The Standard NAFEMS Benchmarks, 1990, LE1) gives the tangential stress at the end of the hole's long axis.
"""

import numpy as np
from tests.published.case import (
    Case,
    Reference,
    Solution,
    cauchy_at,
    equilibria,
    graded,
    mapped_box,
    nearest,
    rollers,
    triangles_where,
)

import supple as sp

YOUNGS = 210e9
STEEL = sp.StVenantKirchhoff(youngs=YOUNGS, poisson=0.3)


def quarter(divisions, thickness):
    """Around the hole from its long axis on, outwards with cells that grow, and across the thickness [m]."""

    def place(x):
        angle, out = graded(x[:, 0], divisions[0], 1.5) * np.pi / 2, graded(x[:, 1], divisions[1], 1.5)
        inner = np.column_stack([2.0 * np.cos(angle), 1.0 * np.sin(angle)])
        outer = np.column_stack([3.25 * np.cos(angle), 2.75 * np.sin(angle)])
        return np.column_stack([inner + out[:, None] * (outer - inner), thickness * (x[:, 2] - 0.5)])

    return mapped_box(divisions, place)


def on_outer_edge(x):
    """Whether points (n, 3) are on the outer ellipse."""
    return (x[:, 0] / 3.25) ** 2 + (x[:, 1] / 2.75) ** 2 > 1 - 1e-9


def solve(divisions):
    mesh = quarter(divisions, 0.1)
    x = mesh.vertices
    tension = sp.Pressure("membrane", -10e6, triangles_where(mesh, on_outer_edge(x)))
    scene = sp.Scene(
        [sp.Body("membrane", mesh, STEEL)],
        soft_targets=[
            rollers("membrane", mesh, 0, x[:, 0] < 1e-9, YOUNGS),
            rollers("membrane", mesh, 1, x[:, 1] < 1e-9, YOUNGS),
            rollers("membrane", mesh, 2, np.arange(len(x)) == nearest(mesh, (2.0, 0.0, -0.05)), YOUNGS),
        ],
        loads=[tension],
        gravity=(0, 0, 0),
    )
    frame = equilibria(scene)[-1]
    corners = [nearest(mesh, (2.0, 0.0, z)) for z in (-0.05, 0.05)]
    stress = np.mean([cauchy_at(frame, "membrane", corner)[1, 1] for corner in corners])
    return Solution({"stress": stress / 1e6}, frame)


CASE = Case(
    title="Elliptic membrane (LE1)",
    source="NAFEMS 1990",
    references={"stress": Reference(92.7, "MPa", coarse=0.04)},
    solve=solve,
    meshes=((8, 4, 1), (24, 12, 1)),
    differs="A slab with free faces, and strains of 0.04 % that are not small by definition but by size.",
    look={"color": "von_mises"},
)
