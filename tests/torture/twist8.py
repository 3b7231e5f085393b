"""A rod is twisted by eight turns while its ends move together: it folds and touches itself."""

from functools import partial
from typing import Any

import numpy as np
from tests.torture.watch import ContactMeasurement, Torture

from supple.app.demos.demo import Claim, Demo, pin_error
from supple.materials.elastic import NeoHookean
from supple.mesh import shapes
from supple.results.frame import Frame
from supple.scene.body import Body
from supple.scene.motion import Keyframes
from supple.scene.pins import Pin
from supple.scene.scene import Scene
from supple.scene.selection import InBox
from supple.solvers.implicit.solver import Implicit

LENGTH, SIDE = 1.0, 0.06
TURNS, SECONDS, CLOSER = 8.0, 20.0, 0.5


def scene(cells: tuple[int, int], turns: float = TURNS) -> Scene:
    """A square rod along x, of cells[0] by cells[1] by cells[1] cells.

    Its ends turn in opposite directions, each by half of the turns, and move closer by half a metre.
    """
    mesh = shapes.box((LENGTH, SIDE, SIDE), (cells[0], cells[1], cells[1]))
    rod = Body("rod", mesh, NeoHookean(youngs=1e5, poisson=0.4, density=1000.0))

    def turning(sign: float) -> Keyframes:
        return Keyframes(
            [0.0, SECONDS * turns / TURNS],
            displacements=[(0, 0, 0), (-sign * CLOSER / 2, 0, 0)],
            angles=[0.0, sign * np.pi * turns],
            axis=(1, 0, 0),
        )

    half = LENGTH / 2 - 1e-9
    return Scene(
        bodies=[rod],
        pins=[
            Pin("rod", InBox((half, -1, -1), (1, 1, 1)), turning(1.0), name="right"),
            Pin("rod", InBox((-1, -1, -1), (-half, 1, 1)), turning(-1.0), name="left"),
        ],
        gravity=(0, -1.0, 0),
    )


class _Measurement(ContactMeasurement):
    def values(self, frame: Frame) -> dict[str, Any]:
        details = {"contacts": frame.report.details.contacts, "pin_error": pin_error(frame)}
        return {**super().values(frame), **details}

    def own_claims(self) -> list[Claim]:
        off, most = max(self.series["pin_error"]), max(self.series["contacts"])
        return [
            Claim(
                "both ends make all of their turns and are exactly where their motion puts them",
                f"up to t = {self.last.time:.2f} s, at most {off:.1e} m off",
                self.last.time >= self.steps * self.dt - 1e-9 and off <= 1e-12,
            ),
            Claim("the rod touches itself", f"up to {most} contacts in a frame", most > 0),
        ]


def demo(cells: tuple[int, int], dt: float, turns: float = TURNS, steps: int | None = None) -> Demo:
    """The twist in steps of dt [s]."""
    return Demo(
        name="torture-twist8",
        summary="a rod twisted by eight turns folds and touches itself",
        explanation=(
            "Scripted pins turn the ends of a square rod (Neo-Hookean, E = 100 kPa) against each other, by eight turns "
            "in twenty seconds, and push them together to half their distance. The rod buckles, folds and winds around "
            "itself; contact keeps it from passing through itself."
        ),
        scene=partial(scene, cells, turns),
        solvers={"implicit": Implicit},
        measurement=_Measurement,
        dt=dt,
        steps=round(SECONDS * turns / TURNS / dt) if steps is None else steps,
    )


TWIST8 = Torture(small=demo((24, 1), 1 / 4, 3.0), full=demo((48, 2), 1 / 10), large=demo((136, 5), 1 / 2, steps=22))
