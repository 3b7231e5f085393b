"""A muscle that is held at both ends: its force is activation times strength times area."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.app.demos.demo import Claim, Demo, Measurement
from supple.materials.elastic import StableNeoHookean
from supple.mesh import shapes
from supple.results.frame import Frame
from supple.scene.body import Body
from supple.scene.loads.muscle import Muscle
from supple.scene.loads.over_time import Curve
from supple.scene.pins import Pin
from supple.scene.scene import Scene
from supple.scene.selection import InBox
from supple.solvers.implicit.solver import Implicit
from supple.solvers.xpbd.solver import XPBD

LENGTH, SIDE, STRENGTH = 0.2, 0.04, 3e4
ACTIVATION = Curve([0.0, 0.2, 0.4, 0.6, 0.8], [0.0, 1.0, 1.0, 0.3, 0.3])


def scene() -> Scene:
    """Two equal bars of muscle, one held at both ends, the other one at one end, without gravity."""
    material = StableNeoHookean(youngs=1e5, poisson=0.4, damping=0.02)
    mesh = shapes.box((LENGTH, SIDE, SIDE), (8, 2, 2))
    bodies = [Body("held", mesh, material), Body("free", mesh, material, position=(0, 3 * SIDE, 0))]
    left, right = (InBox((at - 1e-6, -1, -1), (at + 1e-6, 1, 1)) for at in (-LENGTH / 2, LENGTH / 2))
    pins = [Pin("held", left, name="left"), Pin("held", right, name="right"), Pin("free", left, name="wall")]
    curve = ([0.5, 0.95, 1.05, 1.6], [0.0, 1.0, 1.0, 0.0])
    muscles = [Muscle(body.name, STRENGTH, (1, 0, 0), ACTIVATION, force_length=curve) for body in bodies]
    return Scene(bodies, pins=pins, loads=muscles, gravity=(0, 0, 0))


class _Measurement(Measurement):
    def values(self, frame: Frame) -> dict[str, Any]:
        forces = {str(pin.pin.name): frame.reactions[pin.label] for pin in frame.system.pins}
        length = float(np.ptp(frame.positions["free"][:, 0]))
        return {**super().values(frame), "time": frame.time, **forces, "length": length}

    def claims(self) -> list[Claim]:
        expected = np.array([float(ACTIVATION(time)) for time in self.series["time"]]) * STRENGTH * SIDE**2
        largest = STRENGTH * SIDE**2
        left, right = np.array(self.series["left"]), np.array(self.series["right"])
        error = max(float(np.abs(sign * pull[:, 0] - expected).max()) for sign, pull in ((-1, left), (1, right)))
        sums = float(np.abs(left + right).max())
        shortest = min(self.series["length"]) / LENGTH
        return [
            Claim(
                f"the held muscle pulls with activation x strength x area, up to {largest:.3g} N, within 1 %",
                f"largest difference {100 * error / largest:.2g} % of that",
                error <= 0.01 * largest,
            ),
            Claim(
                "both ends pull alike, within 1 %", f"largest sum {100 * sums / largest:.2g} %", sums <= 0.01 * largest
            ),
            Claim("the free one shortens by more than 15 %", f"to {100 * shortest:.1f} %", shortest < 0.85),
            self.no_tet_inverts(),
        ]


MUSCLE = Demo(
    name="muscle",
    summary="a muscle between two walls, and one that shortens",
    explanation=(
        "Fibres along two bars are activated, fully and then by 30 %. The bar between two walls keeps its shape "
        "and pulls on them; the other one shortens until its elastic stress balances that of the fibres."
    ),
    scene=scene,
    solvers={"xpbd": XPBD, "implicit": lambda: Implicit(contact=None)},
    measurement=_Measurement,
    dt=1 / 60,
    steps=60,
)
