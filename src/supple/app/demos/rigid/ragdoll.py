"""A doll of soft limbs on hinged bones that falls on the floor."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.app.demos.demo import Claim, Demo, Measurement
from supple.materials.elastic import StableNeoHookean
from supple.mesh import shapes
from supple.results.frame import Frame
from supple.scene.body import Body
from supple.scene.contact_pairs import ContactPair
from supple.scene.joints.axis_joint import AxisJoint, HingeJoint
from supple.scene.joints.joint import Joint
from supple.scene.joints.point_joints import BallJoint
from supple.scene.joints.weld import Weld
from supple.scene.obstacles.half_space import HalfSpace
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.scene import Scene
from supple.scene.selection import InBox
from supple.solvers.implicit.solver import Implicit

# Center and size [m] of the flesh on the middle and on the doll's right, where x is positive.
MIDDLE = {"torso": ((0, 0.75, 0), (0.2, 0.3, 0.1)), "head": ((0, 0.98, 0), (0.1, 0.12, 0.1))}
RIGHT = {
    "upper arm": ((0.19, 0.86, 0), (0.16, 0.05, 0.05)),
    "lower arm": ((0.36, 0.86, 0), (0.16, 0.05, 0.05)),
    "thigh": ((0.055, 0.48, 0), (0.08, 0.22, 0.08)),
    "shin": ((0.055, 0.25, 0), (0.06, 0.22, 0.06)),
}
BEND = 2.2
VELOCITY = (0.3, 0.0, 0.8)
DAMPING = 0.02


def scene() -> Scene:
    """Each part is a soft box with a rigid bone in it; the vertices in the bone's box are welded to it."""
    parts = dict(MIDDLE)
    for side, sign in (("right", 1.0), ("left", -1.0)):
        parts |= {f"{side} {name}": ((sign * c[0], c[1], c[2]), size) for name, (c, size) in RIGHT.items()}
    flesh = StableNeoHookean(youngs=1e5, poisson=0.3, density=900.0, damping=0.01)
    bodies: list[Any] = []
    welds = []
    for name, (center, size) in parts.items():
        divisions = tuple(4 if length > 0.12 else 2 for length in size)
        bodies.append(Body(name, shapes.box(size, divisions), flesh, position=center, friction=0.5, velocity=VELOCITY))
        core = np.where(np.array(size) > 0.12, 0.6, 0.3) * size
        bone = shapes.box_surface(tuple(core), (1, 1, 1))
        bodies.append(RigidBody(f"{name} bone", bone, density=1800.0, position=center, velocity=VELOCITY))
        box = InBox(center - 0.51 * core, center + 0.51 * core)
        welds.append(Weld(name, f"{name} bone", box, name=name))
    floor = HalfSpace(point=(0, 0, 0), normal=(0, 1, 0), friction=0.5, name="floor")
    inside = ContactPair("* bone", "*", collide=False)  # bones are covered by flesh
    return Scene(bodies, obstacles=[floor], joints=_joints(), welds=welds, contact_pairs=[inside])


def _joints() -> list[Joint]:
    joints: list[Joint] = [BallJoint("head bone", "torso bone", point=(0, 0.91, 0), name="neck")]
    for side, sign in (("right", 1.0), ("left", -1.0)):
        joints += [
            BallJoint(f"{side} upper arm bone", "torso bone", point=(sign * 0.105, 0.86, 0), name=f"{side} shoulder"),
            BallJoint(f"{side} thigh bone", "torso bone", point=(sign * 0.055, 0.595, 0), name=f"{side} hip"),
            _hinge(f"{side} lower arm", f"{side} upper arm", (sign * 0.275, 0.86, 0), (0, -sign, 0), f"{side} elbow"),
            _hinge(f"{side} shin", f"{side} thigh", (sign * 0.055, 0.365, 0), (1, 0, 0), f"{side} knee"),
        ]
    return joints


def _hinge(first: str, second: str, point: Any, axis: Any, name: str) -> HingeJoint:
    first, second = f"{first} bone", f"{second} bone"
    return HingeJoint(first, second, point=point, axis=axis, limits=(-0.05, BEND), damping=DAMPING, name=name)


class _Measurement(Measurement):
    def values(self, frame: Frame) -> dict[str, Any]:
        joints = frame.report.joints
        angles = {name: one.coordinate for name, one in joints.items() if one.coordinate is not None}
        forces: Any = frame.report.details
        return {
            **super().values(frame),
            "violation": max(one.violation for one in joints.values()),
            "angles": list(angles.values()),
            "floor": -forces.contact_forces["floor"][1],
            "distance": frame.report.min_distance,
            "kinetic": frame.report.kinetic_energy,
        }

    def claims(self) -> list[Claim]:
        joints = [joint for joint in self.first.system.scene.joints if isinstance(joint, AxisJoint)]
        limits = np.array([joint.limits for joint in joints], dtype=np.float64)
        angles = np.array(self.series["angles"])
        beyond = float(np.maximum(limits[:, 0] - angles, angles - limits[:, 1]).max())
        violation = max(self.series["violation"])
        weight = 9.81 * float(self.last.system.masses.sum())
        end = max(1, len(self.series["floor"]) // 10)
        off = abs(float(np.mean(self.series["floor"][-end:])) / weight - 1.0)
        nearest = min((one for one in self.series["distance"] if one is not None), default=0.0)
        return [
            Claim("every step converges", self.endings, self.every_step_converged),
            Claim("joints hold within 1e-6 of a bone's size", f"largest violation {violation:.2g}", violation < 1e-6),
            Claim(
                "knees and elbows stay within their limits, to 1e-6 rad",
                f"largest excess {beyond:.2g} rad",
                beyond < 1e-6,
            ),
            Claim("the floor carries the doll at the end, within 2 %", f"difference {100 * off:.2g} %", off < 0.02),
            Claim("no surfaces touch or meet", f"smallest distance {nearest:.2g} m", nearest > 0.0),
            self.no_tet_inverts(),
        ]


RAGDOLL = Demo(
    name="ragdoll",
    summary="a doll of soft limbs on hinged bones falls on the floor",
    explanation=(
        "Ten soft limbs have rigid bones, to which their inner vertices are welded. Balls join the bones at neck, "
        "shoulders and hips, hinges with limits at elbows and knees. The doll falls on the floor and comes to rest."
    ),
    scene=scene,
    solvers={"implicit": lambda: Implicit()},
    measurement=_Measurement,
    dt=1 / 100,
    steps=200,
)
