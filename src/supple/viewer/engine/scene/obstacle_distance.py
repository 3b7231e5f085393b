"""How far points are from an obstacle, and which way leads out of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.scene.obstacles import Box, HalfSpace, Obstacle, Sphere


def signed_distance(obstacle: Obstacle, points: NDArray[np.float64], time: float) -> NDArray[np.float64]:
    """(k,) distance of points (k, 3) from an obstacle's surface at `time` [m], below zero within the solid.

    Infinite from triangle obstacles: those are left to whoever looks at pairs of triangles.
    """
    R, t = obstacle.pose(time)
    local = (points - t) @ R
    match obstacle:
        case HalfSpace():
            normal = np.asarray(obstacle.normal)
            return (local - np.asarray(obstacle.point)) @ (normal / np.linalg.norm(normal))
        case Sphere():
            distance = np.linalg.norm(local - np.asarray(obstacle.center), axis=1) - obstacle.radius
        case Box():
            half = 0.5 * np.asarray(obstacle.size)
            beyond = np.abs((local - np.asarray(obstacle.center)) @ obstacle.orientation) - half
            distance = np.linalg.norm(np.maximum(beyond, 0.0), axis=1) + np.minimum(beyond.max(axis=1), 0.0)
        case _:
            return np.full(len(points), np.inf)
    return -distance if obstacle.inside else distance


def moved_out(obstacle: Obstacle, points: NDArray[np.float64], time: float, gap: float) -> NDArray[np.float64]:
    """Points (k, 3), those nearer than `gap` [m] moved straight out until they are that far."""
    moved = points.copy()
    for _ in range(4):  # one is enough on flat and round surfaces; edges of boxes take another
        distance = signed_distance(obstacle, moved, time)
        near = np.flatnonzero(distance < gap)
        if len(near) == 0:
            break
        reach = 0.25 * gap
        ways = [
            signed_distance(obstacle, moved[near] + step, time) - signed_distance(obstacle, moved[near] - step, time)
            for step in reach * np.eye(3)
        ]
        slope = np.stack(ways, axis=1) / (2.0 * reach)
        length = np.linalg.norm(slope, axis=1, keepdims=True)
        out = np.divide(slope, length, out=np.zeros_like(slope), where=length > 1e-12)
        # A hair more, so that round-off does not leave a point where it was.
        moved[near] += (1.001 * gap - distance[near])[:, None] * out
    return moved
