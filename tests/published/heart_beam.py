"""A beam of heart muscle, 10 x 1 x 1 mm with fibres along it, is clamped at one end, and a pressure of 4 Pa that
follows the surface lifts it from below. The material is that of Guccione with C = 2 kPa, bf = 8, bt = 2 and bfs = 4,
incompressible. Land et al. (2015), problem 1: eleven codes agree that the middle of the upper edge of its end comes
to a height of 4.17 mm within half a percent.
"""

import numpy as np
from tests.published.case import Case, Reference, Solution, equilibria, mapped_box, nearest, triangles_where

import supple as sp

STEPS = 8


def solve(divisions):
    mesh = mapped_box(divisions, lambda x: x * (0.01, 0.001, 0.001))
    x = mesh.vertices
    muscle = sp.Guccione(c=2e3, bf=8.0, bt=2.0, bfs=4.0, directions=[[1, 0, 0]], bulk=1e6)
    pressure = sp.Curve([0.0, 0.5], [0.0, 4.0])
    scene = sp.Scene(
        [sp.Body("beam", mesh, muscle)],
        pins=[sp.Pin("beam", np.flatnonzero(x[:, 0] < 1e-9))],
        loads=[sp.Pressure("beam", pressure, triangles_where(mesh, x[:, 2] < 1e-9))],
        gravity=(0, 0, 0),
    )
    frame = equilibria(scene, STEPS)[-1]
    tip = nearest(mesh, (0.01, 0.0005, 0.001))
    return Solution({"height of the end": 1e3 * frame.positions["beam"][tip, 2]}, frame)


CASE = Case(
    title="Beam of heart muscle",
    source="Land 2015",
    references={"height of the end": Reference(4.17, "mm")},
    solve=solve,
    meshes=((8, 2, 2), (20, 2, 2)),
    differs="The bulk modulus is 1 MPa; half of the steps hold the pressure, until its direction stays.",
    look={"color": "von_mises"},
)
