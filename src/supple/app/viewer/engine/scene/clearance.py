"""Points that are moved out of obstacles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.scene.obstacles.obstacle import Obstacle


def signed_distance(
    obstacle: Obstacle, points: NDArray[np.float64], time: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Distances (k,) of points (k, 3) from an obstacle at `time` [m], below zero in the solid; and normals (k, 3)."""
    R, t = obstacle.pose(time)
    distances, normals = obstacle.signed_distance((points - t) @ R)
    return distances, normals @ R.T


def moved_out(obstacle: Obstacle, points: NDArray[np.float64], time: float, gap: float) -> NDArray[np.float64]:
    """Points (k, 3), those nearer than `gap` [m] moved straight out until they are that far.

    Triangle obstacles are left out: their sheets have two sides.
    """
    moved = points.copy()
    if obstacle.surface_mesh is not None:
        return moved
    for _ in range(4):  # one is enough on flat and round surfaces; edges of boxes take another
        distances, normals = signed_distance(obstacle, moved, time)
        near = distances < gap
        if not near.any():
            break
        # Slightly more, so that round-off does not leave a point where it was.
        moved[near] += (1.001 * gap - distances[near])[:, None] * normals[near]
    return moved
