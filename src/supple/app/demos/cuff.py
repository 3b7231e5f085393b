"""A ring of a membrane is blown up around a soft ball, and lifts it."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.app.demos.demo import Claim, Demo, Measurement, meetings
from supple.materials.elastic import StableNeoHookean
from supple.materials.shells.shell_material import ShellMaterial
from supple.mesh import shapes
from supple.results.frame import Frame
from supple.scene.body import Body
from supple.scene.loads.cavity import Cavity
from supple.scene.loads.over_time import Curve
from supple.scene.motion import Keyframes
from supple.scene.obstacles.half_space import HalfSpace
from supple.scene.pins import Pin
from supple.scene.scene import Scene
from supple.scene.shell import Shell
from supple.solvers.implicit.solver import Implicit
from supple.solvers.xpbd.solver import XPBD

RING, TUBE, BALL, LIFT, PRESSURE, G = 0.06, 0.018, 0.036, 0.08, 7e3, 9.81
FRICTION = 0.8
BLOWN, BEGUN, LIFTED = 0.5, 0.6, 1.4  # [s]


def scene() -> Scene:
    """A ring of 12 cm, whose outer half is held; its inner half swells against a ball of 7 cm."""
    membrane = ShellMaterial(youngs=3e5, poisson=0.45, thickness=1e-3, density=1000.0, damping=0.01)
    soft = StableNeoHookean(youngs=5e4, poisson=0.4, density=500.0, damping=0.01)
    ring = shapes.torus_surface(RING, TUBE, 0.012)
    outer = np.flatnonzero(np.hypot(ring.vertices[:, 0], ring.vertices[:, 2]) > RING + 0.3 * TUBE)
    bodies: list[Any] = [
        Shell("cuff", ring, membrane, position=(0, BALL, 0), friction=FRICTION),
        Body("ball", shapes.sphere(BALL, 0.5 * BALL), soft, position=(0, BALL + 3e-4, 0), friction=FRICTION),
    ]
    motion = Keyframes([0.0, BEGUN, LIFTED], [(0, 0, 0), (0, 0, 0), (0, LIFT, 0)])
    return Scene(
        bodies,
        obstacles=[HalfSpace(name="floor", friction=0.5)],
        pins=[Pin("cuff", outer, motion=motion)],
        cavities=[Cavity("cuff", pressure=Curve([0.0, BLOWN], [0.0, PRESSURE]))],
    )


class _Measurement(Measurement):
    def values(self, frame: Frame) -> dict[str, Any]:
        contacts = frame.contacts
        return {
            **super().values(frame),
            "meetings": meetings(frame),
            "time": frame.time,
            "height": float(frame.positions["ball"][:, 1].mean()),
            "lowest": float(frame.positions["ball"][:, 1].min()),
            "carried": np.zeros(3) if contacts is None else contacts.force_between("ball", "cuff"),
        }

    def claims(self) -> list[Claim]:
        series = {name: np.array(values) for name, values in self.series.items()}
        held = series["time"] > LIFTED + 0.1
        slip = float(np.ptp(series["height"][held])) if held.any() else np.inf
        lowest = float(series["lowest"][-1])
        part = next(part for part in self.last.system.bodies if part.name == "ball")
        weight = float(self.last.system.masses[part.vertices].sum()) * G
        carried = series["carried"][held].mean(axis=0) if held.any() else np.zeros(3)
        off = float(np.abs(carried - [0.0, weight, 0.0]).max()) / weight
        return [
            Claim(
                f"the ball is lifted by {100 * LIFT:g} cm, within 5 mm",
                f"its lowest point is at {100 * lowest:.2f} cm",
                abs(lowest - LIFT) < 5e-3,
            ),
            Claim("held, it slips by less than 0.5 mm", f"slip {1e3 * slip:.3g} mm", slip < 5e-4),
            Claim(
                "the membrane carries its weight within 3 % on average",
                f"largest difference {100 * off:.2g} %",
                off < 0.03,
            ),
            self.nothing_crosses(),
            self.no_tet_inverts(),
        ]


CUFF = Demo(
    name="cuff",
    summary="a ring of a membrane is blown up around a soft ball, and lifts it",
    explanation=(
        "The outer half of a ring, a membrane of 1 mm, is held. Air at 7 kPa blows up its inner half around a soft "
        "ball, which it grips by friction, lifts and holds. Shell, cavity, pins and contact with friction act together."
    ),
    scene=scene,
    solvers={"implicit": Implicit, "xpbd": XPBD},
    measurement=_Measurement,
    steps=110,
)
