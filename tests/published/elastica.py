"""A slender cantilever of length L carries a force P of fixed direction on its end, with P L^2 / (E I) = 10. Bisshopp
and Drucker (1945) give the exact solution of the inextensible beam by elliptic integrals; Mattiasson (1981) tabulates
it: the end sinks by 0.81061 L and comes nearer to the clamp by 0.55500 L.
"""

import numpy as np
from tests.published.case import Case, Reference, Solution, equilibria, mapped_box, nearest, triangles_where

import supple as sp

THICKNESS = 0.01  # of the length; the shear and the stretch that the beam lacks are of its square


def cantilever(divisions):
    return mapped_box(divisions, lambda x: x * (1.0, THICKNESS, THICKNESS) - (0, THICKNESS / 2, THICKNESS / 2))


def solve(divisions):
    mesh = cantilever(divisions)
    x = mesh.vertices
    force = 10.0 * 1e6 * THICKNESS**4 / 12
    curve = sp.Curve([0.0, 1.0], [(0.0, 0.0, 0.0), (0.0, -force / THICKNESS**2, 0.0)])
    scene = sp.Scene(
        [sp.Body("beam", mesh, sp.StVenantKirchhoff(youngs=1e6, poisson=0.0))],
        pins=[sp.Pin("beam", np.flatnonzero(x[:, 0] < 1e-9))],
        loads=[sp.Traction("beam", curve, triangles_where(mesh, x[:, 0] > 1 - 1e-9))],
        gravity=(0, 0, 0),
    )
    frame = equilibria(scene, 4)[-1]
    tip = nearest(mesh, (1, 0, 0))
    moved = frame.positions["beam"][tip] - x[tip]
    return Solution({"sinks by": -moved[1], "nearer by": -moved[0]}, frame)


CASE = Case(
    title="Elastica, P L^2 / (E I) = 10",
    source="Mattiasson 1981",
    references={"sinks by": Reference(0.81061, "L"), "nearer by": Reference(0.55500, "L")},
    solve=solve,
    meshes=((24, 1, 1), (48, 2, 2)),
    order=2.0,
)
