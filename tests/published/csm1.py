"""An elastic flag, 0.35 m long and 0.02 m high, is clamped to a cylinder of radius 0.05 m and hangs under a gravity
of 2 m/s^2 in plane strain: St. Venant-Kirchhoff with mu = 0.5 MPa and nu = 0.4 and 1,000 kg/m^3. Turek and Hron
(2006), CSM1, give where the middle of its end goes.
"""

import numpy as np
from tests.published.case import Case, Reference, Solution, equilibria, mapped_box, nearest, rollers

import supple as sp

THICKNESS = 0.02


def flag(divisions, shear, damping=0.0):
    """The flag in plane strain, and the vertex in the middle of its end."""

    def place(x):
        y = 0.02 * (x[:, 1] - 0.5)
        begin = np.sqrt(0.05**2 - y**2)
        return np.column_stack([begin + x[:, 0] * (0.4 - begin), y, THICKNESS * (x[:, 2] - 0.5)])

    mesh = mapped_box(divisions, place)
    x, youngs = mesh.vertices, 2 * shear * 1.4
    law = sp.StVenantKirchhoff(youngs=youngs, poisson=0.4, density=1000, damping=damping)
    scene = sp.Scene(
        [sp.Body("flag", mesh, law)],
        pins=[sp.Pin("flag", np.flatnonzero(x[:, 0] ** 2 + x[:, 1] ** 2 < 0.05**2 + 1e-9))],
        soft_targets=[rollers("flag", mesh, 2, np.abs(x[:, 2]) > THICKNESS / 2 - 1e-9, youngs)],
        gravity=(0, -2, 0),
    )
    return scene, nearest(mesh, (0.4, 0, 0))


def solved(divisions, shear):
    scene, tip = flag(divisions, shear)
    frame = equilibria(scene)[-1]
    moved = frame.positions["flag"][tip] - scene.bodies[0].mesh.vertices[tip]
    return Solution({"end moves by": 1e3 * moved[:2]}, frame)


CASE = Case(
    title="Flag under its weight (CSM1)",
    source="Turek, Hron 2006",
    references={"end moves by": Reference((-7.187, -66.10), "mm")},
    solve=lambda divisions: solved(divisions, 0.5e6),
    meshes=((20, 1, 1), (64, 3, 1)),
    look={"color": "von_mises"},
)
