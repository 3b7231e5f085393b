"""Placing bodies by the coordinates of their joints (forward kinematics).

A hinge or slider between a and b that is given a coordinate moves everything that is connected to one side of it, by
joints, welds and stitches, as one. That is the side of the first, unless it is held by the world and the other is not.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.kinds.checks import number
from supple.kinds.suggestion import suggestion
from supple.scene.body import PlacedBody
from supple.scene.joints.axis_joint import AxisJoint
from supple.scene.joints.joint import Joint
from supple.scene.rotation import rotation_matrix

# In the graph of what is connected, what does not move: the world, obstacles, and what pins hold.
_WORLD = None


def at_positions(
    bodies: Sequence[PlacedBody],
    joints: Sequence[Joint],
    links: Iterable[tuple[str | None, str | None]],
    positions: Mapping[str, float],
) -> tuple[list[PlacedBody], list[Joint]]:
    """The bodies and joints where the joints have other coordinates.

    Parameters
    ----------
    links : further pairs of bodies that move together; None is the world
    positions : by name of a hinge or slider, its coordinate [rad] or [m]

    Raises
    ------
    SceneError : where no hinge or slider has a name, a coordinate is not a number or outside of its joint's limits, or
        both sides of a joint are connected by others.
    """
    placed = {body.name: body for body in bodies}
    found = {str(joint.name): joint for joint in joints}
    for name, value in positions.items():
        joint = found.get(name)
        if not isinstance(joint, AxisJoint):
            known = [key for key, one in found.items() if isinstance(one, AxisJoint)]
            raise SceneError(f"joint positions: no hinge or slider has the name {name!r}; {suggestion(name, known)}")
        q = number(value, f"joint positions: {name!r}")
        low, high = joint.limits or (-np.inf, np.inf)
        if not low <= q <= high:
            raise SceneError(f"joint positions: {name!r} is {q:g}, outside of the joint's limits ({low:g}, {high:g})")
        moved = replace(joint, start=q)
        (R, t), (R0, t0) = moved.motion_to_start(), joint.motion_to_start()
        R, t = R @ R0.T, t - R @ R0.T @ t0
        edges = [
            (one.first, one.second if one.second in placed else _WORLD) for key, one in found.items() if key != name
        ]
        side = _connected(joint.first, [*edges, *links])
        second = joint.second if joint.second in placed else _WORLD
        if second in side:
            raise SceneError(
                f"joint positions: both sides of {name!r} are connected by other joints, welds or stitches; give "
                "coordinates of joints that are not in a loop"
            )
        if _WORLD in side:
            side, R, t = _connected(second, [*edges, *links]), R.T, -R.T @ t
            if _WORLD in side:
                raise SceneError(f"joint positions: the world holds both sides of {name!r}")
            # The axis is that of the second, which moves.
            moved = _moved_joint(moved, R, t)
        found[name] = moved
        for key in placed.keys() & side:
            placed[key] = _moved_body(placed[key], R, t)
        found |= {key: _moved_joint(one, R, t) for key, one in found.items() if key != name and one.first in side}
    return list(placed.values()), list(found.values())


def _connected(start: str | None, edges: Sequence[tuple[str | None, str | None]]) -> set[str | None]:
    """Everything that is connected to `start`, which the world does not pass on."""
    neighbours: dict[str | None, list[str | None]] = {}
    for a, b in edges:
        neighbours.setdefault(a, []).append(b)
        neighbours.setdefault(b, []).append(a)
    reached, waiting = {start}, [start]
    while waiting:
        for other in neighbours.get(waiting.pop(), ()):
            if other not in reached:
                reached.add(other)
                if other is not _WORLD:
                    waiting.append(other)
    return reached


def _moved_body(body: PlacedBody, R: NDArray[np.float64], t: NDArray[np.float64]) -> PlacedBody:
    from scipy.spatial.transform import Rotation

    rotation = Rotation.from_matrix(R @ rotation_matrix(body.rotation)).as_rotvec()
    return body.changed(position=R @ np.asarray(body.position) + t, rotation=rotation)


def _moved_joint(joint: Joint, R: NDArray[np.float64], t: NDArray[np.float64]) -> Joint:
    this: Any = joint
    changes: dict[str, NDArray[np.float64]] = {}
    if joint.point is not None:
        changes["point"] = R @ np.asarray(joint.point) + t
    for key in ("axis", "second_axis"):
        if getattr(joint, key, None) is not None:
            changes[key] = R @ np.asarray(getattr(joint, key))
    return replace(this, **changes)
