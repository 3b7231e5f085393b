"""A mass of 1 kg hangs 1 m from a hinge, is let go where it is level with it, and swings under gravity of 9.81 m/s^2.
IFToMM's library of benchmarks, A01 (2006), has this as its first problem. The exact period is 4 K(sin^2 45 deg)
sqrt(J / (m g L)), with the complete elliptic integral K and the moment of inertia J about the hinge.
"""

from typing import Any

import numpy as np
from scipy.special import ellipk
from tests.published.case import DYNAMIC, Case, Reference, Solution, crossings, simulated

import supple as sp

G, SIDE = 9.81, 0.05


def solve(dt):
    cube = sp.shapes.box_surface((SIDE, SIDE, SIDE), (1, 1, 1))
    ball = sp.RigidBody("mass", cube, mass=1.0, position=(-1, 0, 0))
    scene = sp.Scene([ball], joints=[sp.HingeJoint("mass", None, point=(0, 0, 0))], gravity=(0, -G, 0))
    values: dict[str, Any] = {}
    frame: Any = None
    for name, solver in DYNAMIC.items():
        frames = simulated(scene, solver, dt, 2.0)
        lowest = crossings([f.time for f in frames], [f.poses["mass"].translation[0] for f in frames])
        values[f"period, {name}"] = 2 * (lowest[1] - lowest[0])
        frame = frames[round(0.4 / dt)]
    return Solution(values, frame)


PERIOD = 4 * ellipk(0.5) * np.sqrt((1 + SIDE**2 / 6) / G)
CASE = Case(
    title="Simple pendulum",
    source="IFToMM 2006",
    references={f"period, {name}": Reference(PERIOD, "s") for name in DYNAMIC},
    solve=solve,
    meshes=(1 / 50, 1 / 240),
    differs="The source has a point; here it is a cube of 5 cm, whose moment of inertia is in the reference. Coarse "
    "and fine are steps of 1/50 and 1/240 s.",
)
