"""A finger with notches that a tendon bends and releases."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.app.demos.demo import Claim, Demo, Measurement
from supple.materials.elastic import StableNeoHookean
from supple.mesh import shapes
from supple.mesh.tetmesh import TetMesh
from supple.results.frame import Frame
from supple.scene.body import Body
from supple.scene.loads.cable import Cable
from supple.scene.loads.over_time import Curve
from supple.scene.pins import Pin
from supple.scene.scene import Scene
from supple.scene.selection import InBox
from supple.solvers.implicit.solver import Implicit
from supple.solvers.xpbd.solver import XPBD

CELL, LENGTH, HEIGHT, WIDTH = 0.01, 16, 4, 3  # [m]; numbers of cells
TENSION, FULL, HELD, RELEASED = 3.0, 0.3, 0.7, 0.8
STEPS = 80


def finger() -> TetMesh:
    """A bar along x with notches from below, every fourth cell, two cells deep."""
    cells = np.array([LENGTH, HEIGHT, WIDTH])
    mesh = shapes.box(tuple(cells * CELL), tuple(int(n) for n in cells))
    vertices = mesh.vertices + 0.5 * cells * CELL
    i, j, _ = np.floor(vertices[mesh.tets].mean(axis=1) / CELL).astype(int).T
    tets = mesh.tets[~((i % 4 == 2) & (j < 2))]
    used, numbers = np.unique(tets, return_inverse=True)
    return TetMesh(vertices[used], numbers.reshape(-1, 4))


def scene() -> Scene:
    """The finger before a wall, and the tendon through its pads to a winch in the wall."""
    material = StableNeoHookean(youngs=1e5, poisson=0.4, damping=0.06)
    low, middle = 0.5 * CELL, 0.5 * WIDTH * CELL
    eyelets = [("finger", ((4 * k + 0.5) * CELL, low, middle)) for k in reversed(range(1, 4))]
    winch = (None, (-2 * CELL, low, middle))
    pull = Curve([0.0, FULL, HELD, RELEASED], [0.0, TENSION, TENSION, 0.0])
    tendon = Cable([("finger", ((LENGTH - 0.5) * CELL, low, middle)), *eyelets, winch], tension=pull, name="tendon")
    wall = Pin("finger", InBox((-1, -1, -1), (1e-6, 1, 1)), name="wall")
    return Scene([Body("finger", finger(), material)], pins=[wall], cables=[tendon], gravity=(0, 0, 0))


class _Measurement(Measurement):
    def values(self, frame: Frame) -> dict[str, Any]:
        rest = frame.system.rest_positions
        x = frame.positions["finger"]
        # The last cells keep their shape.
        front, back = (np.abs(rest[:, 0] - at * CELL) < 1e-9 for at in (LENGTH, LENGTH - 1))
        way = x[front].mean(axis=0) - x[back].mean(axis=0)
        end, winch = _last_span(frame)
        cable = frame.report.cables["tendon"]
        pull = cable.tension[-1] * (winch - end) / np.linalg.norm(winch - end)
        open_ = frame.reactions[frame.system.pins[0].label] + pull
        return {
            **super().values(frame),
            "time": frame.time,
            "angle": float(np.degrees(np.arctan2(-way[1], way[0]))),
            "left": float(np.linalg.norm(open_)),
            "work": cable.work,
            "stored": frame.report.elastic_energy,
            "damped": -frame.report.work["damping"],
        }

    def claims(self) -> list[Claim]:
        time, angle = np.array(self.series["time"]), np.array(self.series["angle"])
        held = int(np.abs(time - HELD).argmin())
        bent, left = float(angle[held]), float(self.series["left"][held])
        until = time < HELD
        work, damped = (float(np.array(self.series[name])[until].sum()) for name in ("work", "damped"))
        stored = float(np.array(self.series["stored"])[until][-1])
        lost = abs(work - stored - damped) / work
        return [
            Claim("the tip turns by more than 60 degrees", f"{bent:.1f} degrees with {TENSION:g} N", bent > 60.0),
            Claim(
                "the wall holds against the winch, within 6 % of the tension",
                f"what is left {100 * left / TENSION:.2g} %",
                left < 0.06 * TENSION,
            ),
            Claim(
                "the work of the winch is what the finger stores and damps, within 10 %",
                f"{1e3 * work:.3g} mJ of work, {1e3 * stored:.3g} mJ stored, {1e3 * damped:.3g} mJ damped",
                lost <= 0.1,
            ),
            Claim(
                "it straightens when it is released", f"{angle[-1]:.1f} degrees at the end", abs(angle[-1]) < 0.1 * bent
            ),
            self.no_tet_inverts(),
        ]


def _last_span(frame: Frame) -> tuple[np.ndarray, np.ndarray]:
    """The places of the last eyelet and of the winch [m]."""
    coordinate: Any = frame.system.actuators[0].coordinate
    points = coordinate.weights @ frame.state.positions[coordinate.vertices] + coordinate.offsets
    return points[-2], points[-1]


TENDON_FINGER = Demo(
    name="tendon_finger",
    summary="a notched finger bent by a tendon, and released",
    explanation=(
        "A tendon runs through the pads between the notches of a finger to a winch in the wall. Its tension closes the "
        "notches; without it the finger springs back."
    ),
    scene=scene,
    solvers={"xpbd": XPBD, "implicit": Implicit},
    measurement=_Measurement,
    dt=1 / 60,
    steps=STEPS,
)
