"""A sphere stretched by two pins and brought back."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.app.demos.demo import Claim, Demo, Measurement, volume
from supple.materials.elastic import StableNeoHookean
from supple.mesh import shapes
from supple.results.frame import Frame
from supple.scene.body import Body
from supple.scene.motion import Keyframes
from supple.scene.pins import Pin
from supple.scene.scene import Scene
from supple.scene.selection import InBox
from supple.solvers.implicit.solver import Implicit
from supple.solvers.xpbd.solver import XPBD

RADIUS, PULL = 0.5, 0.5


def scene() -> Scene:
    """A sphere of radius 0.5 m; two pins move its caps outward by 0.5 m each, hold them, and bring them back."""
    ball = Body(
        "ball",
        shapes.sphere(radius=RADIUS, edge_length=0.1),
        StableNeoHookean(youngs=5e4, poisson=0.45, density=1000.0, damping=0.02),
    )
    times = [0.2, 1.4, 2.2, 3.4]
    right = Keyframes(times, [[0, 0, 0], [PULL, 0, 0], [PULL, 0, 0], [0, 0, 0]])
    left = Keyframes(times, [[0, 0, 0], [-PULL, 0, 0], [-PULL, 0, 0], [0, 0, 0]])
    return Scene(
        bodies=[ball],
        pins=[
            Pin("ball", InBox((0.42, -1, -1), (1, 1, 1)), right, name="right"),
            Pin("ball", InBox((-1, -1, -1), (-0.42, 1, 1)), left, name="left"),
        ],
        gravity=(0, 0, 0),
    )


class _Measurement(Measurement):
    def values(self, frame: Frame) -> dict[str, Any]:
        ratio = volume(frame, "ball") / volume(self.first, "ball")
        length = float(np.ptp(frame.positions["ball"][:, 0]))
        return {**super().values(frame), "length and ratio": (length, ratio)}

    def claims(self) -> list[Claim]:
        longest, ratio = max(self.series["length and ratio"])
        off = float(np.linalg.norm(self.last.positions["ball"] - self.first.positions["ball"], axis=1).max())
        return [
            Claim(
                "stretched to twice its length, it keeps its volume within 12 % (Poisson's ratio 0.45 lets it grow)",
                f"length {longest:.3f} m, volume ratio {ratio:.4f}",
                longest > 1.9 * 2 * RADIUS and abs(ratio - 1.0) <= 0.12,
            ),
            self.no_tet_inverts(),
            Claim(
                "at the end every vertex is back to within 1 % of the diameter",
                f"largest distance {off:.4f} m",
                off <= 0.02 * RADIUS,
            ),
        ]


STRETCH = Demo(
    name="stretch",
    summary="a sphere stretched by two pins",
    explanation=(
        "Two pins move the caps of a rubber ball (E = 50 kPa, nu = 0.45) apart to twice its diameter, hold them, and "
        "bring them back. The middle becomes thinner, so the volume changes little. The ball returns to its rest shape."
    ),
    scene=scene,
    solvers={"xpbd": lambda: XPBD(substeps=20), "implicit": Implicit},
    measurement=_Measurement,
    steps=300,
)
