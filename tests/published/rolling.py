"""A ball that slides over a plane with friction begins to turn, and rolls after 2 v / (7 mu g). Coriolis (1835): from
then on its speed is 5/7 of the first, whatever the friction is. Here it starts on a level plane.
"""

from typing import Any

import numpy as np
from tests.published.case import Case, Reference, Solution

import supple as sp

RADIUS, MU, SPEED, G = 0.05, 0.3, 1.0, 9.81


def frames_of(setting, solver):
    """The frames of .13 s of the ball in Supple; setting : step [s], and edges as a share of the radius."""
    dt, edge = setting
    surface = sp.shapes.sphere_surface(RADIUS, edge * RADIUS)
    J = 0.4 * RADIUS**2
    ball = sp.RigidBody(
        "ball", surface, mass=1.0, inertia=(J, J, J), center=(0, 0, 0), position=(0, RADIUS, 0), velocity=(SPEED, 0, 0),
        friction=MU,
    )  # fmt: skip
    low = float(ball.place(ball.points)[:, 1].min())
    plane = sp.HalfSpace(name="plane", point=(0, low - 1e-4, 0), normal=(0, 1, 0), friction=MU)
    scene = sp.Scene([ball], obstacles=[plane], gravity=(0, -G, 0))
    return list(sp.simulate(scene, solver, dt, round(0.13 / dt)))


def solve(setting):
    values: dict[str, Any] = {}
    frame: Any = None
    for name, solver in SOLVERS.items():
        frames = frames_of(setting, solver)
        values[f"speed, {name}"] = np.mean([f.poses["ball"].velocity[0] for f in frames[-len(frames) // 6 :]]) / SPEED
        frame = frames[-1]
    return Solution(values, frame)


SOLVERS = {"Implicit": sp.Implicit(integrator="bdf2"), "XPBD": sp.XPBD()}
CASE = Case(
    title="Ball from sliding to rolling",
    source="Coriolis 1835",
    references={f"speed, {name}": Reference(5 / 7, "v", bound=0.02) for name in SOLVERS},
    solve=solve,
    meshes=((1 / 200, 0.1), (1 / 400, 0.04)),
    differs="The ball is a polyhedron with edges of a tenth and a twenty-fifth of its radius, which loses a "
    "little at each edge that it rolls over; coarse and fine are steps of 1/200 and 1/400 s.",
)
