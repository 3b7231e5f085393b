"""A thick rubber ball, inner radius 1 m and outer radius 2 m, is blown up until its inner radius has grown by half.
Green and Shield (1950) give the pressure for an incompressible Neo-Hookean material: mu / 2 (4 / s + 1 / s^4) at the
outer face less the same at the inner face, with the stretches s of the faces. The material has nu = 0.499.
"""

import numpy as np
from tests.published.case import Case, Reference, Solution, equilibria, rollers, triangles_where

import supple as sp

MU, GROWN, INNER, OUTER, POISSON = 1e5, 1.5, 1.0, 2.0, 0.499


def pressure():
    outer = (OUTER**3 + (GROWN**3 - 1) * INNER**3) ** (1 / 3) / OUTER
    of = [0.5 * (4 / s + 1 / s**4) for s in (outer, GROWN)]
    return MU * (of[0] - of[1])


def octant(cells, across):
    """An eighth of the ball: three blocks, one below each face of a cube."""
    unit = sp.shapes.box((1.0, 1.0, 1.0), (cells, cells, across), order=2)
    u, v, w = (unit.vertices + 0.5).T
    faces = [np.column_stack(face) for face in ((u * 0 + 1, u, v), (v, u * 0 + 1, u), (u, v, u * 0 + 1))]
    r = (INNER + (OUTER - INNER) * w)[:, None]
    points = np.concatenate([r * face / np.linalg.norm(face, axis=1)[:, None] for face in faces])
    _, first, number = np.unique(points.round(9), axis=0, return_index=True, return_inverse=True)
    nodes = np.concatenate([unit.nodes + k * len(unit.vertices) for k in range(3)])
    return sp.TetMesh(points[first], number.ravel()[nodes])


def solve(divisions):
    mesh = octant(*divisions)
    x = mesh.vertices
    youngs = 2 * MU * (1 + POISSON)
    inner = np.linalg.norm(x, axis=1) < INNER + 1e-6
    load = sp.Curve([0.0, 1.0], [0.0, pressure()])
    scene = sp.Scene(
        [sp.Body("ball", mesh, sp.StableNeoHookean(youngs=youngs, poisson=POISSON))],
        soft_targets=[rollers("ball", mesh, axis, x[:, axis] < 1e-9, youngs) for axis in range(3)],
        loads=[sp.Pressure("ball", load, triangles_where(mesh, inner))],
        gravity=(0, 0, 0),
    )
    frame = equilibria(scene, 4)[-1]
    return Solution({"inner radius": np.linalg.norm(frame.positions["ball"][inner], axis=1).mean()}, frame)


CASE = Case(
    title="Inflated rubber ball",
    source="Green, Shield 1950",
    references={"inner radius": Reference(GROWN, "m", coarse=0.01)},
    solve=solve,
    meshes=((2, 2), (4, 4)),
    look={"color": "von_mises"},
)
