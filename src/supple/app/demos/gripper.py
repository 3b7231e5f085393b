"""Two soft fingers on a rigid palm take a rigid box from the floor, lift it and hold it."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.app.demos.demo import Claim, Demo, Measurement
from supple.materials.elastic import StableNeoHookean
from supple.mesh import shapes
from supple.results.frame import Frame
from supple.scene.body import Body
from supple.scene.joints.axis_joint import SliderJoint
from supple.scene.joints.motors import PositionMotor
from supple.scene.joints.weld import Weld
from supple.scene.loads.over_time import Curve
from supple.scene.obstacles.half_space import HalfSpace
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.scene import Scene
from supple.solvers.implicit.solver import Implicit
from supple.solvers.xpbd.solver import XPBD

MASS, G = 0.5, 9.81
WEIGHT = MASS * G
LIFT = 0.1
FRICTION = 0.8
GRIPPED, LIFTED, END = 0.5, 1.5, 4.5
LARGEST_GRIP, LARGEST_LIFT = 12.0, 60.0


def scene() -> Scene:
    """Fingers of 20 x 60 x 20 mm, welded to carriers that slide on the palm, which slides up and down."""
    # Without damping, the box swings between the fingers by 40 um in XPBD, which loses no energy at its short substeps.
    soft = StableNeoHookean(youngs=5e6, poisson=0.3, density=1000.0, damping=0.005)
    finger = shapes.box((0.02, 0.06, 0.02), (2, 5, 2))
    block = shapes.box_surface((0.02, 0.02, 0.02), (1, 1, 1))
    bodies: list[Any] = [
        RigidBody(
            "box",
            shapes.box_surface((0.06, 0.06, 0.06), (1, 1, 1)),
            mass=MASS,
            position=(0, 0.0301, 0),
            friction=FRICTION,
        ),
        RigidBody(
            "palm", shapes.box_surface((0.18, 0.02, 0.04), (1, 1, 1)), mass=0.4, position=(0, 0.12, 0), look="steel"
        ),
    ]
    lift = Curve([0, GRIPPED, LIFTED], [0, 0, LIFT])
    joints = [
        SliderJoint(
            "palm",
            axis=(0, 1, 0),
            motor=PositionMotor(lift, stiffness=2e4, damping=500.0, max_force=LARGEST_LIFT),
            name="lift",
        )
    ]
    welds = []
    for name, side in (("left", -1.0), ("right", 1.0)):
        bodies += [
            Body(f"{name} finger", finger, soft, position=(side * 0.043, 0.055, 0), friction=FRICTION),
            RigidBody(f"{name} carrier", block, mass=0.05, position=(side * 0.043, 0.095, 0), look="steel"),
        ]
        welds.append(Weld(f"{name} finger", f"{name} carrier", max_distance=1e-6, name=f"{name} weld"))
        # The targets are 5 mm behind the faces of the box: fingers and motors are its springs.
        closing = PositionMotor(Curve([0, GRIPPED], [0, 0.008]), stiffness=2000.0, damping=50.0, max_force=LARGEST_GRIP)
        joints.append(
            SliderJoint(
                f"{name} carrier", "palm", axis=(-side, 0, 0), limits=(0, 0.02), motor=closing, name=f"{name} grip"
            )
        )
    floor = HalfSpace(point=(0, 0, 0), normal=(0, 1, 0), friction=0.5, name="floor")
    return Scene(bodies, obstacles=[floor], joints=joints, welds=welds)


class _Measurement(Measurement):
    def values(self, frame: Frame) -> dict[str, Any]:
        joints, poses = frame.report.joints, frame.poses
        contacts = frame.contacts
        fingers = np.zeros(3)
        if contacts is not None:
            for name in ("left finger", "right finger"):
                fingers = fingers + contacts.force_between("box", name)
        return {
            **super().values(frame),
            "time": frame.time,
            "held": poses["box"].translation - poses["palm"].translation,
            "height": float(frame.positions["box"][:, 1].min()),
            "carried": fingers,
            "lift": joints["lift"].motor_force,
            "grip": max(abs(joints[f"{side} grip"].motor_force or 0.0) for side in ("left", "right")),
            "violation": max(one.violation for one in joints.values()),
        }

    def claims(self) -> list[Claim]:
        series = {name: np.array(values) for name, values in self.series.items()}
        holding = series["time"] >= LIFTED + 0.01
        height = float(series["height"][-1])
        held = series["held"][holding]
        slip = float(np.linalg.norm(held - held[0], axis=1).max()) if len(held) else np.inf
        carried = series["carried"][holding & (series["time"] > END - 1.0)]
        off = float(np.abs(carried - [0, WEIGHT, 0]).max()) / WEIGHT if len(carried) else np.inf
        moved = float(self.last.system.masses.sum())
        lift_off = abs(float(series["lift"][-1]) / (moved * G) - 1.0)
        grip, lift = float(series["grip"].max()), float(np.abs(series["lift"]).max())
        violation = float(series["violation"].max())
        return [
            Claim(
                f"the box is lifted by {LIFT} m, within 2 mm",
                f"its lowest corner is at {height:.4f} m",
                abs(height - LIFT) < 2e-3,
            ),
            Claim("it is held for 3 s, and slips by less than 1 mm", f"slip {1e3 * slip:.3f} mm", slip < 1e-3),
            Claim("the fingers carry its weight within 1 %", f"largest difference {100 * off:.2g} %", off < 0.01),
            Claim(
                "the lifting motor carries all weights within 1 %",
                f"{series['lift'][-1]:.4f} N of {moved * G:.4f} N",
                lift_off < 0.01,
            ),
            Claim(
                f"no motor exceeds its maximum, {LARGEST_GRIP:g} N at the grip and {LARGEST_LIFT:g} N at the lift",
                f"{grip:.3g} N and {lift:.3g} N",
                grip <= LARGEST_GRIP and lift <= LARGEST_LIFT,
            ),
            Claim("joints hold within 1e-6 of a body's size", f"largest violation {violation:.2g}", violation < 1e-6),
            self.no_tet_inverts(),
        ]


GRIPPER = Demo(
    name="gripper",
    summary="two soft fingers on a rigid palm lift a rigid box",
    explanation=(
        "Two soft fingers are welded to rigid carriers, which motors slide on a rigid palm. They grip a rigid box of "
        "half a kilogram with the friction of their sides; a motor lifts the palm by 10 cm, and they hold the box for "
        "three seconds. Contact, friction, joints, motors and welds act together, and the forces add up."
    ),
    scene=scene,
    solvers={"implicit": Implicit, "xpbd": XPBD},
    measurement=_Measurement,
    dt=1 / 60,
    steps=270,
)
