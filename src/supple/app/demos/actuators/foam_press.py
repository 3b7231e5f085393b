"""A block of foam under a press: its force against the displacement."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import brentq

from supple.app.demos.demo import Claim, Demo, Measurement
from supple.materials.elastic import StableNeoHookean
from supple.mesh import shapes
from supple.results.frame import Frame
from supple.results.readings.reading import DrivenReading
from supple.scene.body import Body
from supple.scene.motion import Keyframes
from supple.scene.obstacles.box import Box
from supple.scene.obstacles.half_space import HalfSpace
from supple.scene.scene import Scene
from supple.solvers.implicit.solver import Implicit

SIDE, HEIGHT, PRESSED, STEPS = 0.1, 0.05, 0.02, 20
YOUNGS, POISSON = 5e4, 0.2
GAP = 2e-4


def force(stretch: float) -> float:
    """Of the block that is compressed uniformly to this share of its height, free at its sides [N]."""
    law = StableNeoHookean(youngs=YOUNGS, poisson=POISSON).per_tet(1)
    mu, lam = float(law.mu[0]), float(law.lam[0])

    def side_stress(side: float) -> float:
        J = side * side * stretch
        return mu * side - mu * side * stretch + lam * (J - 1.0) * side * stretch

    side: Any = brentq(side_stress, 0.5, 2.0)
    J = side * side * stretch
    return -(mu * stretch - mu * side**2 + lam * (J - 1.0) * side**2) * SIDE**2


def scene() -> Scene:
    """The block between a floor and a plate without friction; the plate goes down by two fifths of its height."""
    foam = StableNeoHookean(youngs=YOUNGS, poisson=POISSON, damping=0.002, density=100.0)
    block = Body("foam", shapes.box((SIDE, HEIGHT, SIDE), (6, 3, 6)), foam, position=(0, 0.5 * HEIGHT + GAP, 0))
    down = Keyframes(times=[0.0, 1.0], displacements=[[0, 0, 0], [0, -PRESSED - 2 * GAP, 0]])
    plate = Box(name="press", center=(0, HEIGHT + 2 * GAP + 0.005, 0), size=(1.2 * SIDE, 0.01, 1.2 * SIDE), motion=down)
    return Scene([block], [HalfSpace(name="floor"), plate], gravity=(0, 0, 0))


class _Measurement(Measurement):
    def values(self, frame: Frame) -> dict[str, Any]:
        press = frame.sensors["press"]
        assert isinstance(press, DrivenReading)
        y, rest = frame.positions["foam"][:, 1], frame.system.rest_positions[:, 1]
        high = float(y[rest > 0.0].max() - y.min())
        return {**super().values(frame), "height": high, "force": -press.force[1]}

    def claims(self) -> list[Claim]:
        stretch, measured = np.array(self.series["height"]) / HEIGHT, np.array(self.series["force"])
        expected = np.array([force(value) for value in stretch])
        largest = float(expected.max())
        error = float(np.abs(measured - expected).max())
        return [
            Claim(
                "the force is that of the closed form at every height, within 1 % of the largest",
                f"largest difference {100 * error / largest:.2g} % of {largest:.1f} N",
                error <= 0.01 * largest,
            ),
            Claim(
                "it is pressed to less than 61 % of its height", f"{100 * stretch[-1]:.1f} %", bool(stretch[-1] < 0.61)
            ),
            self.no_tet_inverts(),
        ]


FOAM_PRESS = Demo(
    name="foam_press",
    summary="the force of a press on foam against its displacement",
    explanation=(
        "A plate presses a block of foam on a floor, without friction, so that it is compressed uniformly. report.csv "
        "has the force and the displacement of the plate, and plot.png draws one over the other."
    ),
    scene=scene,
    solvers={"implicit": Implicit},
    measurement=_Measurement,
    dt=1 / 20,
    steps=STEPS,
)
