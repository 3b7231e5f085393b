"""A quarter of a circle, 4.12 to 4.32 in in radius and 0.1 in thick, is clamped at one end; E = 1e7 psi and Poisson's
ratio is 0.25. A unit force acts on the other end, once along the radius and once across the plane. MacNeal and Harder
(1985) give 0.08734 and 0.5022 in by beam theory; Krysl's FinEtools has 0.088519 and 0.498302 by refined solid
elements.
"""

import numpy as np
from tests.published.case import Case, Reference, Solution, equilibria, mapped_box, nearest, triangles_where

import supple as sp

INNER, OUTER, THICKNESS = 4.12, 4.32, 0.1
LOAD = 0.01  # of the unit force, so that the deflection is small, as the source has it


def solve(divisions):
    def place(x):
        angle, r = x[:, 0] * np.pi / 2, INNER + (OUTER - INNER) * x[:, 1]
        return np.column_stack([r * np.sin(angle), r * np.cos(angle), THICKNESS * (x[:, 2] - 0.5)])

    mesh = mapped_box(divisions, place)
    x = mesh.vertices
    end = x[:, 1] < 1e-9
    middle, values, frame = nearest(mesh, ((INNER + OUTER) / 2, 0, 0)), {}, None
    for name, axis in {"along the radius": 0, "across the plane": 2}.items():
        traction = LOAD * np.eye(3)[axis] / (THICKNESS * (OUTER - INNER))
        scene = sp.Scene(
            [sp.Body("beam", mesh, sp.StVenantKirchhoff(youngs=1e7, poisson=0.25))],
            pins=[sp.Pin("beam", np.flatnonzero(x[:, 0] < 1e-9))],
            loads=[sp.Traction("beam", traction, triangles_where(mesh, end))],
            gravity=(0, 0, 0),
        )
        frame = equilibria(scene)[-1]
        values[name] = (frame.positions["beam"][middle, axis] - x[middle, axis]) / LOAD
    assert frame is not None
    return Solution(values, frame)


CASE = Case(
    title="Curved beam",
    source="MacNeal, Harder 1985",
    references={
        "along the radius": Reference(0.08734, "in", bound=0.0135),
        "across the plane": Reference(0.5022, "in"),
    },
    solve=solve,
    meshes=((24, 2, 2), (64, 6, 4)),
    differs="The bound is the scatter of the sources: 1.35 and 0.78 %.",
)
