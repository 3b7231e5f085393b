"""A slender cantilever of length L is rolled up into a full circle by the moment 2 pi E I / L on its end, which turns
with the end. That is Euler's elastica with constant curvature; Simo and Vu-Quoc (1986), section 4, have it as their
first example. The end must come back to the clamp.
"""

import numpy as np
from tests.published.case import Case, Reference, Solution, equilibria, nearest, triangles_where
from tests.published.elastica import THICKNESS, cantilever

import supple as sp

YOUNGS = 1e6


def solve(divisions):
    mesh = cantilever(divisions)
    x = mesh.vertices
    end = x[:, 0] > 1 - 1e-9
    # Pressures p and -p on the two halves of the end have the moment p h^3 / 4 in every position of the end.
    pressure = 2 * np.pi * YOUNGS * THICKNESS**4 / 12 * 4 / THICKNESS**3
    halves = [end & (side * x[:, 1] > -1e-9) for side in (1, -1)]
    scene = sp.Scene(
        [sp.Body("beam", mesh, sp.StVenantKirchhoff(youngs=YOUNGS, poisson=0.0))],
        pins=[sp.Pin("beam", np.flatnonzero(x[:, 0] < 1e-9))],
        loads=[
            sp.Pressure("beam", sp.Curve([0.0, 1.0], [0.0, side * pressure]), triangles_where(mesh, half))
            for side, half in zip((1, -1), halves, strict=True)
        ],
        gravity=(0, 0, 0),
    )
    frame = equilibria(scene, 16)[-1]
    y = frame.positions["beam"]
    tip, quarter = nearest(mesh, (1, 0, 0)), nearest(mesh, (0.5, 0, 0))
    return Solution({"end": y[tip] - x[tip] + (1, 0, 0), "diameter": float(np.linalg.norm(y[quarter]))}, frame)


CASE = Case(
    title="Cantilever rolled up by a moment",
    source="Simo, Vu-Quoc 1986",
    references={
        "end": Reference((0.0, 0.0, 0.0), "L", scale=1.0),
        "diameter": Reference(1 / np.pi, "L"),
    },
    solve=solve,
    meshes=((24, 2, 1), (48, 2, 2)),
    differs="The moment is a pair of pressures on the halves of the end.",
)
