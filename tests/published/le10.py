"""A quarter of a thick elliptic plate with an elliptic hole, 0.6 m thick, of the outline of LE1. The upper face
carries a pressure of 1 MPa; the outer face is held in its plane, and the middle line of it also across. NAFEMS (The
Standard NAFEMS Benchmarks, 1990, LE10) gives the stress across the long axis on the upper face at the end of the
hole.
"""

import numpy as np
from tests.published.case import Case, Reference, Solution, cauchy_at, equilibria, nearest, rollers, triangles_where
from tests.published.le1 import STEEL, YOUNGS, on_outer_edge, quarter

import supple as sp


def solve(divisions):
    mesh = quarter(divisions, 0.6)
    x = mesh.vertices
    outer = on_outer_edge(x)
    scene = sp.Scene(
        [sp.Body("plate", mesh, STEEL)],
        soft_targets=[
            rollers("plate", mesh, 0, outer | (x[:, 0] < 1e-9), YOUNGS),
            rollers("plate", mesh, 1, outer | (x[:, 1] < 1e-9), YOUNGS),
            rollers("plate", mesh, 2, outer & (np.abs(x[:, 2]) < 1e-9), YOUNGS),
        ],
        loads=[sp.Pressure("plate", 1e6, triangles_where(mesh, x[:, 2] > 0.3 - 1e-9))],
        gravity=(0, 0, 0),
    )
    frame = equilibria(scene)[-1]
    stress = cauchy_at(frame, "plate", nearest(mesh, (2.0, 0.0, 0.3)))[1, 1]
    return Solution({"stress": stress / 1e6}, frame)


CASE = Case(
    title="Thick plate (LE10)",
    source="NAFEMS 1990",
    references={"stress": Reference(-5.38, "MPa")},
    solve=solve,
    meshes=((8, 4, 2), (16, 10, 6)),
    differs="Displacements may be large; they are a thousandth of the thickness.",
    look={"color": "von_mises"},
)
