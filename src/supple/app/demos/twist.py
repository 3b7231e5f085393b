"""A bar twisted by four turns without an inverted tetrahedron."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.app.demos.demo import Claim, Demo, Measurement, pin_error
from supple.materials.elastic import NeoHookean
from supple.mesh import shapes
from supple.results.frame import Frame
from supple.scene.body import Body
from supple.scene.motion import Keyframes
from supple.scene.pins import Pin
from supple.scene.scene import Scene
from supple.scene.selection import InBox
from supple.solvers.implicit.solver import Implicit

LENGTH, SIDE, YOUNGS, POISSON = 1.0, 0.2, 1e5, 0.45
TURNS, SECONDS = 4, 4.0


def scene() -> Scene:
    """A bar of 1 x 0.2 x 0.2 m; its ends turn against each other, four turns in four seconds."""
    bar = Body(
        "bar",
        shapes.box((LENGTH, SIDE, SIDE), (24, 4, 4)),
        NeoHookean(youngs=YOUNGS, poisson=POISSON, density=1000.0),
    )

    def turning(sign: float) -> Keyframes:
        """The motion of one end, which makes half of all turns."""
        return Keyframes([0.0, SECONDS], angles=[0.0, sign * np.pi * TURNS], axis=(1, 0, 0))

    half = LENGTH / 2 - 1e-9
    return Scene(
        bodies=[bar],
        pins=[
            Pin("bar", InBox((half, -1, -1), (1, 1, 1)), turning(1.0), name="right"),
            Pin("bar", InBox((-1, -1, -1), (-half, 1, 1)), turning(-1.0), name="left"),
        ],
        gravity=(0, 0, 0),
    )


class _Measurement(Measurement):
    def values(self, frame: Frame) -> dict[str, Any]:
        return {"J and time": (frame.report.min_det_F, frame.time), "pin_error": pin_error(frame)}

    def claims(self) -> list[Claim]:
        (min_J, when), off = min(self.series["J and time"]), max(self.series["pin_error"])
        return [
            Claim(
                f"every step to the {TURNS} turns converges",
                f"{self.endings}, of {self.iterations} iterations of Newton, up to t = {self.last.time:.2f} s",
                self.last.time >= SECONDS - 1e-9 and self.every_step_converged,
            ),
            Claim(
                "no tetrahedron inverts in any frame",
                f"smallest det F {min_J:.3f} at {when:.2f} s",
                min_J > 0.0,
            ),
            Claim(
                "in every frame both ends are exactly where their motion puts them",
                f"at most {off:.1e} m off",
                off <= 1e-12,
            ),
        ]


TWIST = Demo(
    name="twist",
    summary="a bar twisted by four turns",
    explanation=(
        "Scripted pins turn the ends of a nearly incompressible bar (Neo-Hookean, E = 100 kPa, nu = 0.45) against each "
        "other, by four turns in four seconds. Its energy is infinite where a tetrahedron has no volume; the step "
        "filter stops every step of Newton's method before that. Contact keeps the bar from passing through itself."
    ),
    scene=scene,
    solvers={"implicit": Implicit},
    measurement=_Measurement,
    steps=240,
)
