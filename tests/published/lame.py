"""A thick cylinder, inner radius 1 m and outer radius 2 m, in plane strain under a small inner pressure; Poisson's
ratio is 0.3. Lame (1852; Timoshenko and Goodier, Theory of Elasticity, section 28) gives the hoop stress p (b^2 / r^2
+ 1) / (b^2 / a^2 - 1) and how far the inner face moves.
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

INNER, OUTER, POISSON = 1.0, 2.0, 0.3
LOAD = 1e-5


def quarter_cylinder(divisions, thickness, material, pressure):
    """The equilibrium of a quarter of a thick cylinder in plane strain under an inner pressure, and its mesh."""

    def place(x):
        angle, r = x[:, 0] * np.pi / 2, INNER + (OUTER - INNER) * graded(x[:, 1], divisions[1], 1.3)
        return np.column_stack([r * np.cos(angle), r * np.sin(angle), thickness * (x[:, 2] - 0.5)])

    mesh = mapped_box(divisions, place)
    x, youngs = mesh.vertices, float(material.youngs)
    planes = x[:, 0] < 1e-9, x[:, 1] < 1e-9, np.abs(x[:, 2]) > thickness / 2 - 1e-9
    inside = np.hypot(x[:, 0], x[:, 1]) < INNER + 1e-9
    load = sp.Pressure("cylinder", pressure, triangles_where(mesh, inside))
    scene = sp.Scene(
        [sp.Body("cylinder", mesh, material)],
        soft_targets=[rollers("cylinder", mesh, axis, plane, youngs) for axis, plane in enumerate(planes)],
        loads=[load],
        gravity=(0, 0, 0),
    )
    return equilibria(scene, 4 if callable(pressure) else 1)[-1], mesh


def solve(divisions):
    youngs = 1e9
    law = sp.StVenantKirchhoff(youngs=youngs, poisson=POISSON)
    frame, mesh = quarter_cylinder(divisions, 0.2, law, LOAD * youngs)
    corners = [nearest(mesh, (INNER, 0, z)) for z in (-0.1, 0.1)]
    hoop = np.mean([cauchy_at(frame, "cylinder", corner)[1, 1] for corner in corners]) / (LOAD * youngs)
    moved = frame.positions["cylinder"][corners[0], 0] - INNER
    return Solution({"inner face moves": moved / LOAD, "hoop stress there": hoop}, frame)


RATIO = OUTER**2 / (OUTER**2 - INNER**2)
MOVED = (1 + POISSON) * ((1 - 2 * POISSON) * INNER**2 / (OUTER**2 - INNER**2) + RATIO) * INNER
CASE = Case(
    title="Thick cylinder under pressure",
    source="Lame 1852",
    references={
        "inner face moves": Reference(MOVED, "p / E [m]"),
        "hoop stress there": Reference(2 * RATIO - 1, "p"),
    },
    solve=solve,
    meshes=((8, 3, 1), (16, 6, 1)),
    order=2.5,
    look={"color": "von_mises"},
)
