"""A rubber rod of radius R is twisted by 1 / R per length, with its ends kept flat and at their distance. Rivlin
(1948) gives the moment pi mu psi R^4 / 2 and the thrust pi mu psi^2 R^4 / 4 on the ends of an incompressible
Neo-Hookean rod: without the thrust it would grow longer (Poynting's effect). The material has nu = 0.4999.
"""

import numpy as np
from tests.published.case import Case, Reference, Solution, equilibria

import supple as sp

MU, POISSON, LENGTH = 1e5, 0.4999, 1.0


def solve(edge_length):
    mesh = sp.shapes.cylinder(radius=1.0, height=LENGTH, edge_length=edge_length, order=2)
    y = mesh.vertices[:, 1] + LENGTH / 2
    turn = sp.Keyframes([0.0, 1.0], angles=[0.0, LENGTH], axis=(0, 1, 0))
    top = np.flatnonzero(y > LENGTH - 1e-9)
    scene = sp.Scene(
        [sp.Body("rod", mesh, sp.StableNeoHookean(youngs=2 * MU * (1 + POISSON), poisson=POISSON))],
        pins=[sp.Pin("rod", np.flatnonzero(y < 1e-9)), sp.Pin("rod", top, turn, name="top")],
        gravity=(0, 0, 0),
    )
    frame = equilibria(scene, 4)[-1]
    forces = frame.report.details.reaction_forces_by_vertex["pin 'top' of body 'rod'"]
    moment = np.cross(frame.positions["rod"][top], forces).sum(axis=0)[1]
    return Solution({"moment": moment / (np.pi * MU), "thrust": -forces[:, 1].sum() / (np.pi * MU)}, frame)


CASE = Case(
    title="Rod under torsion",
    source="Rivlin 1948",
    references={"thrust": Reference(0.25, "pi mu R^2"), "moment": Reference(0.5, "pi mu R^3")},
    solve=solve,
    meshes=(0.5, 0.25),
    order=2.0,
    look={"color": "von_mises"},
)
