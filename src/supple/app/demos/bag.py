"""A cloth whose corners are gathered becomes a bag, which carries six soft balls."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.app.demos.demo import Claim, Demo, Measurement, body_range, meetings
from supple.materials.elastic import StableNeoHookean
from supple.materials.shells.shell_material import ShellMaterial
from supple.mesh import shapes
from supple.results.frame import Frame
from supple.results.recording.thin_cells import ratios_of
from supple.scene.body import Body
from supple.scene.motion import Keyframes
from supple.scene.obstacles.half_space import HalfSpace
from supple.scene.pins import Pin
from supple.scene.scene import Scene
from supple.scene.shell import Shell
from supple.solvers.implicit.solver import Implicit
from supple.solvers.xpbd.solver import XPBD

SIDE, THICKNESS, RADIUS, BALLS, G = 0.5, 2e-3, 0.035, 6, 9.81
GATHERED, CARRIED = 1.2, 1.8  # [s]
TOP, APART, WAY = 0.37, 0.07, 0.2  # of the corners in the end: height, distance from the middle, way to the side [m]


def scene() -> Scene:
    """Five balls around one on a cloth of 50 cm, whose corners go up and together, and then to the side."""
    cloth = ShellMaterial(youngs=2e5, poisson=0.3, thickness=THICKNESS, density=400.0, damping=0.01)
    soft = StableNeoHookean(youngs=5e4, poisson=0.4, density=300.0, damping=0.01)
    surface, ball = shapes.sheet(SIDE, SIDE, SIDE / 12), shapes.sphere(RADIUS, 0.6 * RADIUS)
    bodies: list[Any] = [Shell("bag", surface, cloth, position=(0, THICKNESS, 0), friction=0.4)]
    for k in range(BALLS):
        angle, away = 2.0 * np.pi * k / (BALLS - 1), 0.085 if k < BALLS - 1 else 0.0
        place = (away * np.cos(angle), 2.0 * THICKNESS + RADIUS, away * np.sin(angle))
        bodies.append(Body(f"ball{k + 1}", ball, soft, position=place, friction=0.4))
    pins = []
    for x in (-0.5 * SIDE, 0.5 * SIDE):
        for z in (-0.5 * SIDE, 0.5 * SIDE):
            corner = int(np.argmin(np.linalg.norm(surface.vertices - [x, 0.0, z], axis=1)))
            up = np.array([APART * np.sign(x) - x, TOP, APART * np.sign(z) - z])
            motion = Keyframes(
                [0.0, 0.2, GATHERED, GATHERED + 0.1, CARRIED],
                [np.zeros(3), np.zeros(3), up, up, up + np.array([WAY, 0.0, 0.0])],
            )
            pins.append(Pin("bag", [corner], motion=motion))
    return Scene(bodies, obstacles=[HalfSpace(name="floor", friction=0.4)], pins=pins)


class _Measurement(Measurement):
    def values(self, frame: Frame) -> dict[str, Any]:
        balls = [frame.positions[f"ball{k + 1}"] for k in range(BALLS)]
        held = sum((force for force in frame.reactions.values()), np.zeros(3))
        ratios = ratios_of(body_range(frame, "bag"), frame.positions["bag"])
        return {
            **super().values(frame),
            "meetings": meetings(frame),
            "lowest": min(float(x[:, 1].min()) for x in balls),
            "farthest": max(float(np.hypot(*(x.mean(axis=0) - [WAY, 0, 0])[[0, 2]])) for x in balls),
            "held": float(np.sum(held, axis=0)[1] if np.ndim(held) > 1 else held[1]),
            "ratios": (float(ratios.min()), float(ratios.max())),
            "time": frame.time,
        }

    def claims(self) -> list[Claim]:
        lowest, farthest = self.series["lowest"][-1], self.series["farthest"][-1]
        weight = float(self.last.system.masses.sum()) * G
        late = np.array(self.series["time"]) > CARRIED
        held = float(np.mean(np.array(self.series["held"])[late])) if late.any() else 0.0
        low, high = min(low for low, _ in self.series["ratios"]), max(high for _, high in self.series["ratios"])
        return [
            Claim(
                f"the bag carries all {BALLS} balls: each is above the floor, and less than 12 cm beside its middle",
                f"lowest point of a ball at {100 * lowest:.1f} cm, the farthest {100 * farthest:.1f} cm beside it",
                lowest > 0.03 and farthest < 0.12,
            ),
            self.nothing_crosses(),
            Claim(
                "its corners carry all weights within 2 %, as a mean over its swinging",
                f"{held:.4f} N of {weight:.4f} N",
                abs(held / weight - 1.0) < 0.02,
            ),
            Claim(
                "no triangle of it changes its area by more than 20 %",
                f"ratios of areas from {low:.3f} to {high:.3f}",
                low > 0.8 and high < 1.2,
            ),
            self.no_tet_inverts(),
        ]


BAG = Demo(
    name="bag",
    summary="a cloth whose corners are gathered becomes a bag, which carries six soft balls",
    explanation=(
        "Six soft balls lie on a cloth. Pins gather its four corners, lift them and carry them to the side: the cloth "
        "becomes a bag, and the balls roll together and hang in it. Cloth against balls, balls against each other, and "
        "folds of the cloth against each other touch with friction, at the thickness of the cloth, and nothing crosses."
    ),
    scene=scene,
    solvers={"implicit": Implicit, "xpbd": XPBD},
    measurement=_Measurement,
    steps=140,
)
