"""What a recording keeps of joints: what they hold, and where the scene places their sides."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.model.system import System
from supple.results.recording.checked_hdf5 import CheckedFile
from supple.scene.joints.axis_joint import AxisJoint
from supple.scene.joints.ball_joint import BallJoint
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.rotation import rotation_matrix

KINDS = ("fixed", "ball", "hinge", "slider")


@dataclass(frozen=True, eq=False)
class RecordedJoint:
    """One joint.

    Attributes
    ----------
    name : of the joint; kind : one of `KINDS`
    sides : numbers of what it joins: bodies, then obstacles; None for the world
    placed : (2, 3, 4) rotations and translations of the sides where the scene places everything, where the coordinate
        of the joint is zero
    point, axis : (3,) there, in the world [m], [-]
    limits : of its coordinate [rad] or [m]; twist_limits : of the twist of a ball [rad]; infinite where there are none
    max_force : of its motor [N m] or [N]; max_velocity : of its coordinate [rad/s] or [m/s]; infinite where there is
        none
    """

    name: str
    kind: str
    sides: tuple[int, int | None]
    placed: NDArray[np.float64]
    point: NDArray[np.float64]
    axis: NDArray[np.float64]
    limits: tuple[float, float]
    max_force: float
    max_velocity: float
    twist_limits: tuple[float, float]

    def described(self) -> dict[str, Any]:
        """As the header has it."""
        return {
            "name": self.name,
            "kind": self.kind,
            "sides": list(self.sides),
            "placed": self.placed.tolist(),
            "point": self.point.tolist(),
            "axis": self.axis.tolist(),
            "limits": [end if np.isfinite(end) else None for end in self.limits],
            "twist_limits": [end if np.isfinite(end) else None for end in self.twist_limits],
            "max_force": self.max_force if np.isfinite(self.max_force) else None,
            "max_velocity": self.max_velocity if np.isfinite(self.max_velocity) else None,
        }


def joints_of(system: System) -> tuple[RecordedJoint, ...]:
    """The joints of a scene."""
    bodies = {body.name: body for body in system.scene.bodies}
    obstacles = {str(obstacle.name): obstacle for obstacle in system.obstacles}
    number: dict[str | None, int] = {name: k for k, name in enumerate([*bodies, *obstacles])}
    joints = []
    for joint in system.scene.joints:
        placed = []
        for name in (joint.first, joint.second):
            R, t = np.eye(3), np.zeros(3)
            if name in bodies:
                R, t = rotation_matrix(bodies[name].rotation), np.asarray(bodies[name].position)
            elif name in obstacles:
                R, t = obstacles[name].pose(0.0)
            placed.append(np.column_stack([R, t]))
        first = bodies[joint.first]
        assert isinstance(first, RigidBody)
        axis = joint.axis if isinstance(joint, AxisJoint | BallJoint) else None
        ends = (joint.limits if isinstance(joint, AxisJoint) else None) or (-np.inf, np.inf)
        if isinstance(joint, BallJoint) and joint.max_swing is not None:
            ends = 0.0, joint.max_swing
        most = joint.motor.max_force if isinstance(joint, AxisJoint) and joint.motor is not None else None
        fastest = joint.max_velocity if isinstance(joint, AxisJoint) else None
        joints.append(
            RecordedJoint(
                str(joint.name),
                joint.kind,
                (number[joint.first], number.get(joint.second)),
                np.array(placed),
                np.asarray(joint.place(first), dtype=np.float64),
                np.array([1.0, 0.0, 0.0] if axis is None else axis, dtype=np.float64),
                ends,
                np.inf if most is None else most,
                np.inf if fastest is None else fastest,
                (joint.twist_limits if isinstance(joint, BallJoint) else None) or (-np.inf, np.inf),
            )
        )
    return tuple(joints)


def read_joints(file: CheckedFile, header: dict[str, Any]) -> tuple[RecordedJoint, ...]:
    """The joints of a recording.

    Raises
    ------
    OutputError : where one is not described as it should be, or joins what does not exist or is soft.
    """
    jointed = [body.get("rigid") is True for body in header["bodies"]] + [True] * len(header["obstacles"])
    joints = []
    try:
        for given in header["physics"]["joints"]:
            first, second = int(given["sides"][0]), given["sides"][1]
            low, high = given["limits"]
            least, most = given["twist_limits"]
            joint = RecordedJoint(
                name=str(given["name"]),
                kind=str(given["kind"]),
                sides=(first, None if second is None else int(second)),
                placed=np.array(given["placed"], dtype=np.float64).reshape(2, 3, 4),
                point=np.array(given["point"], dtype=np.float64).reshape(3),
                axis=np.array(given["axis"], dtype=np.float64).reshape(3),
                limits=(-np.inf if low is None else float(low), np.inf if high is None else float(high)),
                max_force=np.inf if given["max_force"] is None else float(given["max_force"]),
                max_velocity=np.inf if given["max_velocity"] is None else float(given["max_velocity"]),
                twist_limits=(-np.inf if least is None else float(least), np.inf if most is None else float(most)),
            )
            joints.append(joint)
            numbers = np.concatenate([joint.placed.ravel(), joint.point, joint.axis])
            ends = [first] if second is None else [first, int(second)]
            there = first < len(header["bodies"]) and min(ends) >= 0 and all(jointed[end] for end in ends)
            if joint.kind not in KINDS or not np.isfinite(numbers).all() or not joint.axis.any() or not there:
                raise ValueError
    except (KeyError, TypeError, ValueError, IndexError, OverflowError):
        raise file.broken("its joints are not described as they should be") from None
    return tuple(joints)
