"""Twenty rigid dominoes in a row: the first is pushed, and each knocks over the next."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.app.demos.demo import Claim, Demo, Measurement
from supple.mesh import shapes
from supple.results.frame import Frame
from supple.scene.obstacles.half_space import HalfSpace
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.scene import Scene
from supple.solvers.implicit.solver import Implicit

COUNT = 20
SIZE = (0.008, 0.05, 0.025)
SPACING = 0.025
PUSH = 3.0
FRICTION = 0.4
# A domino counts as hit once it leans by this angle [rad].
LEANING = 0.05


def scene() -> Scene:
    """Dominoes of 8 x 50 x 25 mm, 25 mm apart; the first begins with an angular velocity."""
    tile = shapes.box_surface(SIZE, (1, 1, 1))
    spin = (0.0, 0.0, -PUSH)
    arm = (0.5 * SIZE[0], -0.5 * SIZE[1], 0.0)  # it turns about the edge on the floor
    bodies = []
    for k in range(COUNT):
        motion: dict[str, Any] = {}
        if k == 0:
            motion = {"angular_velocity": spin, "velocity": -np.cross(spin, arm)}
        place = (k * SPACING, 0.5 * SIZE[1] + 2e-5, 0.0)
        bodies.append(RigidBody(f"domino {k + 1}", tile, density=1200.0, position=place, friction=FRICTION, **motion))
    return Scene(bodies, obstacles=[HalfSpace(friction=FRICTION, name="floor")])


class _Measurement(Measurement):
    def values(self, frame: Frame) -> dict[str, Any]:
        up = np.array([pose.rotation[:, 1] for pose in frame.poses.values()])
        report = frame.report
        return {
            **super().values(frame),
            "time": frame.time,
            "lean": np.arctan2(up[:, 0], up[:, 1]),
            "energy": report.kinetic_energy + report.potential_energy + report.elastic_energy,
            "distance": report.min_distance,
        }

    def claims(self) -> list[Claim]:
        lean, times = np.array(self.series["lean"]), np.array(self.series["time"])
        fallen = int((np.abs(lean[-1]) > 1.0).sum())
        hit = [float(times[np.argmax(column > LEANING)]) for column in lean.T if (column > LEANING).any()]
        middle = np.diff(hit)[len(hit) // 2 :] if len(hit) == COUNT else np.array([np.inf])
        spread = float(np.ptp(middle) / np.mean(middle)) if np.isfinite(middle).all() else np.inf
        first = self.first.report.kinetic_energy + self.first.report.potential_energy
        fall = sum(part.body.properties.mass for part in self.first.system.bodies) * 9.81 * 0.5 * SIZE[1]  # pyright: ignore
        gain = float(max(self.series["energy"]) - first) / fall
        distances = [distance for distance in self.series["distance"] if distance is not None]
        nearest = min(distances, default=0.0)
        return [
            Claim(f"all {COUNT} fall", f"{fallen} lean by more than 1 rad", fallen == COUNT),
            Claim(
                "the wave runs steadily: in the second half, the times from domino to domino differ by less than 20 %",
                f"{1e3 * float(np.mean(middle)):.1f} ms, they differ by {100 * spread:.1f} %",
                spread < 0.2,
            ),
            Claim("energy never grows by more than 1 % of the fall", f"by {100 * gain:.2g} %", gain < 0.01),
            Claim("no surfaces touch or meet", f"smallest distance {nearest:.2g} m", nearest > 0.0),
        ]


DOMINOES = Demo(
    name="dominoes",
    summary="twenty rigid dominoes knock each other over",
    explanation=(
        "Twenty rigid dominoes stand in a row on a floor with friction. The first is pushed; each one knocks over the "
        "next, at a rate that soon becomes steady. Their surfaces never touch, and energy never grows by itself."
    ),
    scene=scene,
    solvers={"implicit": lambda: Implicit()},
    measurement=_Measurement,
    dt=1 / 480,
    steps=600,
)
