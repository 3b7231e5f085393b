"""What a recording keeps of joints: what they hold, and where the scene places their sides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from supple.model.system import System
from supple.results.checkpoint.typed import Rows
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
    placed: Annotated[NDArray[np.float64], Rows(2, 3, 4, finite=True)]
    point: Annotated[NDArray[np.float64], Rows(3, finite=True)]
    axis: Annotated[NDArray[np.float64], Rows(3, finite=True)]
    limits: tuple[float, float]
    max_force: float
    max_velocity: float
    twist_limits: tuple[float, float]

    def check(self, jointed: Sequence[bool], bodies: int) -> None:
        """Raise `ValueError` where it joins what does not exist or is soft, or a number of it is not finite.

        `jointed` tells of bodies, then obstacles, whether a joint may hold them.
        """
        first, second = self.sides
        ends = [first] if second is None else [first, second]
        there = first < bodies and all(0 <= end < len(jointed) and jointed[end] for end in ends)
        if self.kind not in KINDS or not self.axis.any() or not there:
            raise ValueError(f"joint {self.name!r} is not between rigid bodies of the scene, or of an unknown kind")


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
