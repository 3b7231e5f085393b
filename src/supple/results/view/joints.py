"""Joints of rigid bodies: their points, axes and limits, and where between the limits they are."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.results.view.model import Model, RenderFrame
from supple.scene.joints.placed import PlacedJoint

JOINT_COLOR = (225, 120, 20)
_ARC = 32  # lines of a whole turn
# Lengths as shares of the longest distance of the first body's control points: axes reach out of the body.
_AXIS, _LIMIT, _POINT = 0.7, 0.35, 0.08


def lines_of_joints(model: Model) -> list[Sides]:
    """Of each joint, in the coordinates of its two sides."""
    return [joint_lines(joint, _size(model, joint)) for joint in model.joints]


Sides = tuple[NDArray[np.float64], NDArray[np.float64]]


def joint_segments(frame: RenderFrame, lines: list[Sides]) -> NDArray[np.float64]:
    """(k, 2, 3) ends of all lines [m], of those in the coordinates of the two sides of each joint.

    A cross is its point, a line the axis. An arc, a line along the axis or the rim of a cone shows limits; it moves
    with the second side, and a line that moves with the first shows where the joint is.
    """
    placed = []
    for joint, sides in zip(frame.model.joints, lines, strict=True):
        for side, own in zip(joint.sides, sides, strict=True):
            placed.append(_moved(frame, side, own.reshape(-1, 3)).reshape(-1, 2, 3))
    return np.concatenate(placed)


def _moved(frame: RenderFrame, side: int | None, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (k, 3) of a body, an obstacle or the world, where they are now."""
    bodies = frame.model.bodies
    if side is None:
        return points
    if side >= len(bodies):
        pose = frame.poses[side - len(bodies)]
        return points @ pose[:, :3].T + pose[:, 3]
    rows = bodies[side].vertices
    rest = np.column_stack([frame.model.rest_positions[rows], np.ones(4)])
    return np.column_stack([points, np.ones(len(points))]) @ np.linalg.solve(rest, frame.finite_positions[rows])


def _size(model: Model, joint: PlacedJoint) -> float:
    return float(np.ptp(model.rest_positions[model.bodies[joint.sides[0]].vertices], axis=0).max())


def joint_lines(joint: PlacedJoint, size: float) -> Sides:
    """Lines (k, 2, 3) that move with the first side, and with the second, in their coordinates."""
    p, holds = joint.point, joint.conditions
    lines: dict[str, list[Any]] = {"first": [(p - _POINT * size * d, p + _POINT * size * d) for d in np.eye(3)]}
    lines["second"] = []

    def named(vector: str) -> tuple[str, NDArray[np.float64]]:
        side, _, axis = vector.partition(".")
        return side, joint.axes[int(axis)]

    for line in holds.lines:
        side, e = named(line)
        lines[side].append((p - _AXIS * size * e, p + _AXIS * size * e))
    for one in holds.functions:
        low, high = one.limits
        if one.vanishes or not np.isfinite([low, high]).all():
            continue
        hand = named(one.vectors[0])[1] if not one.is_length else named(one.vectors[1])[1]
        if one.is_length:
            tick = _POINT * size * joint.axes[1]
            lines["second"] += [(p + end * hand - tick, p + end * hand + tick) for end in (low, high)]
            continue
        if one.form == "cosine":
            turn = np.linspace(0.0, 2.0 * np.pi, _ARC)
            across = np.linalg.svd(hand[None])[2][1:]
            circle = np.column_stack([np.cos(turn), np.sin(turn)]) @ across
            rim = p + _LIMIT * size * (np.cos(high) * hand + np.sin(high) * circle)
            lines["second"] += [*pairwise(rim), *((p, rim[k]) for k in range(0, _ARC, 8))]
        else:  # an angle or a twist from the second vector to the third
            turn = np.linspace(low, min(high, low + 2.0 * np.pi), _ARC)
            across = np.array([named(vector)[1] for vector in one.vectors[1:3]])
            rim = p + _LIMIT * size * np.column_stack([np.cos(turn), np.sin(turn)]) @ across
            lines["second"] += [*pairwise(rim), (p, rim[0]), (p, rim[-1])]
        lines["first"].append((p, p + 1.2 * _LIMIT * size * hand))
    own = []
    for ends_of_side, pose in zip((lines["first"], lines["second"]), joint.placed, strict=True):
        ends = np.array(ends_of_side, dtype=np.float64).reshape(-1, 3)
        own.append(((ends - pose[:, 3]) @ pose[:, :3]).reshape(-1, 2, 3))
    return own[0], own[1]
