"""Joints with the places of their two sides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.scene.body import PlacedBody
from supple.scene.joints.joint import Conditions, Joint
from supple.scene.obstacles.obstacle import Obstacle
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.rotation import rotation_matrix


@dataclass(frozen=True, eq=False)
class PlacedJoint:
    """A joint where its scene places everything.

    Attributes
    ----------
    sides : numbers of what it joins: bodies, then obstacles; None for the world
    placed : (2, 3, 4) rotations and translations of the sides where the coordinate of the joint is zero
    point : (3,) there, in the world [m]; axes : (3, 3) unit vectors there (rows), which `conditions` numbers
    """

    name: str
    sides: tuple[int, int | None]
    placed: NDArray[np.float64]
    point: NDArray[np.float64]
    axes: NDArray[np.float64]
    conditions: Conditions


def placed_joints(
    bodies: Sequence[PlacedBody], joints: Sequence[Joint], obstacles: Sequence[Obstacle]
) -> tuple[PlacedJoint, ...]:
    """The joints of a scene."""
    things: dict[str, PlacedBody | Obstacle] = {one.name: one for one in bodies}
    things |= {str(one.name): one for one in obstacles}
    number: dict[str | None, int] = {name: k for k, name in enumerate(things)}
    found = []
    for joint in joints:
        first = things[joint.first]
        assert isinstance(first, RigidBody)
        placed = np.array([_pose(first), _pose(None if joint.second is None else things[joint.second])])
        R, shift = joint.motion_to_start()
        placed[0] = np.column_stack([R.T @ placed[0, :, :3], R.T @ (placed[0, :, 3] - shift)])
        sides, point = (number[joint.first], number.get(joint.second)), np.asarray(joint.place(first), dtype=np.float64)
        found.append(PlacedJoint(str(joint.name), sides, placed, point, joint.axes(), joint.conditions()))
    return tuple(found)


def _pose(thing: PlacedBody | Obstacle | None) -> NDArray[np.float64]:
    """(3, 4)"""
    if isinstance(thing, PlacedBody):
        return np.column_stack([rotation_matrix(thing.rotation), np.asarray(thing.position)])
    return np.eye(3, 4) if thing is None else np.column_stack(thing.pose(0.0))
