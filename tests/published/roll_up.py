"""A slender cantilever of length L is rolled up into a full circle by the moment 2 pi E I / L on its end. That is
Euler's elastica with constant curvature; Simo and Vu-Quoc (1986), section 4, have it as their first example. Here the
end face is turned along the arcs of this solution, and what holds it must be that moment and no force, while the
middle goes to the far side of the circle.
"""

import numpy as np
from tests.published.case import Case, Reference, Solution, equilibria, nearest, rollers
from tests.published.elastica import THICKNESS, cantilever

import supple as sp

YOUNGS = 1e6


def solve(divisions):
    mesh = cantilever(divisions)
    x = mesh.vertices
    end = np.flatnonzero(x[:, 0] > 1 - 1e-9)

    def along_arcs(time):
        angle = max(2 * np.pi * time, 1e-12)
        across = np.outer(x[end, 1], (-np.sin(angle), np.cos(angle)))
        places = np.array([np.sin(angle), 1 - np.cos(angle)]) / angle + across
        return np.column_stack([places, x[end, 2]]) - x[end]

    scene = sp.Scene(
        [sp.Body("beam", mesh, sp.StVenantKirchhoff(youngs=YOUNGS, poisson=0.0))],
        pins=[sp.Pin("beam", np.flatnonzero(x[:, 0] < 1e-9)), sp.Pin("beam", end, along_arcs, name="end")],
        soft_targets=[rollers("beam", mesh, 2, np.ones(len(x), dtype=bool), YOUNGS)],
        gravity=(0, 0, 0),
    )
    frame = equilibria(scene, 16)[-1]
    y = frame.positions["beam"]
    forces = frame.report.details.reaction_forces_by_vertex["pin 'end' of body 'beam'"]
    unit = 2 * np.pi * YOUNGS * THICKNESS**4 / 12
    moment = np.cross(y[end] - y[end].mean(axis=0), forces).sum(axis=0)
    middle = nearest(mesh, (0.5, 0, 0))
    values = {"moment": moment[2] / unit, "force": forces.sum(axis=0)[:2] / unit, "middle": y[middle, :2]}
    return Solution(values, frame)


CASE = Case(
    title="Cantilever rolled up by a moment",
    source="Simo, Vu-Quoc 1986",
    references={
        "moment": Reference(1.0, "2 pi E I / L"),
        "force": Reference((0.0, 0.0), "2 pi E I / L^2", scale=1.0),
        "middle": Reference((0.0, 1 / np.pi), "L"),
    },
    solve=solve,
    meshes=((24, 1, 1), (48, 2, 1)),
    order=2.0,
    differs="The end is turned and the moment measured; the beam stays in its plane.",
)
