"""What a recording keeps of joints: what they hold, and where the scene places their sides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from supple.model.system import System
from supple.results.checkpoint.typed import Rows
from supple.scene.joints.conditions import Conditions, Function
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.rotation import rotation_matrix

RecordedFunction = Function

# How many vectors a function of each form has, and the names of those of a joint.
_VECTORS = {"angle": 3, "product": 2, "cosine": 2, "twist": 4}
_NAMES = {"apart", *(f"{side}.{k}" for side in ("first", "second") for k in range(3))}


@dataclass(frozen=True, eq=False)
class RecordedJoint:
    """One joint.

    Attributes
    ----------
    name : of the joint; kind : as scene files write it
    sides : numbers of what it joins: bodies, then obstacles; None for the world
    placed : (2, 3, 4) rotations and translations of the sides where the scene places everything, where the coordinate
        of the joint is zero
    point : (3,) there, in the world [m]; axes : (3, 3) unit vectors there (rows), which `conditions` numbers
    conditions : what it holds and measures
    max_force : of its motor [N m] or [N]; max_velocity : of its coordinate [rad/s] or [m/s]; infinite where there is
        none
    """

    name: str
    kind: str
    sides: tuple[int, int | None]
    placed: Annotated[NDArray[np.float64], Rows(2, 3, 4, finite=True)]
    point: Annotated[NDArray[np.float64], Rows(3, finite=True)]
    axes: Annotated[NDArray[np.float64], Rows(3, 3, finite=True)]
    conditions: Conditions
    max_force: float
    max_velocity: float

    def check(self, jointed: Sequence[bool], bodies: int) -> None:
        """Raise `ValueError` where it joins what does not exist or is soft, or a number of it is not finite.

        `jointed` tells of bodies, then obstacles, whether a joint may hold them.
        """
        first, second = self.sides
        ends = [first] if second is None else [first, second]
        there = first < bodies and all(0 <= end < len(jointed) and jointed[end] for end in ends)
        holds, upright = self.conditions, np.allclose(self.axes @ self.axes.T, np.eye(3), atol=1e-6)
        named = {*holds.lines, *(name for one in holds.functions for name in one.vectors)}
        known = named <= _NAMES and "apart" not in holds.lines and {*holds.parallel} <= {0, 1, 2}
        if not there or not known or any(len(one.vectors) != _VECTORS.get(one.form) for one in holds.functions):
            raise ValueError(f"joint {self.name!r} is not between rigid bodies of the scene, or not one that is known")
        if not upright:
            raise ValueError(f"the axes of joint {self.name!r} are not perpendicular unit vectors")


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
        most = [getattr(getattr(joint, "motor", None), "max_force", None), getattr(joint, "max_velocity", None)]
        sides = number[joint.first], number.get(joint.second)
        where = np.array(placed), np.asarray(joint.place(first), dtype=np.float64), joint.axes()
        ends = [np.inf if end is None else float(end) for end in most]
        joints.append(RecordedJoint(str(joint.name), joint.kind, sides, *where, joint.conditions(), *ends))
    return tuple(joints)
