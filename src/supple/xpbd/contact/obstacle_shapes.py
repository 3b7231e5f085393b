"""Obstacles of simple shape as rows of arrays: planes, solid balls, bowls and solid boxes.

A room (`Box(inside=True)`) is six planes. Triangle obstacles are not here: they are surfaces (`contact_surfaces`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.contact.obstacle_poses import ObstaclePoses
from supple.scene.obstacles import Box, HalfSpace, Obstacle, Sphere

PLANE, BALL, BOWL, BLOCK = 0, 1, 2, 3


@dataclass(frozen=True, eq=False)
class ObstacleShapes:
    """k simple shapes where they are at time 0.

    Attributes
    ----------
    kinds : (k,) PLANE, BALL, BOWL or BLOCK
    owners : (k,) which obstacle of the scene a shape belongs to
    frames : (k, 4, 3) an anchor point [m], then three axes, row by row; a plane's first axis is its normal
    extents : (k, 3) half edge lengths of a block, radius of a ball or bowl in the first entry [m]
    moving : (k,) whether the shape is scripted
    """

    kinds: NDArray[np.int32]
    owners: NDArray[np.int32]
    frames: NDArray[np.float64]
    extents: NDArray[np.float64]
    moving: NDArray[np.bool_]

    def placed(self, poses: ObstaclePoses, time: float) -> NDArray[np.float64]:
        """Frames (k, 4, 3) at `time` [s]."""
        if not self.moving.any():
            return self.frames
        R, t = poses.at(time)
        R, t = R[self.owners], t[self.owners]
        out = self.frames @ R.transpose(0, 2, 1)
        out[:, 0] += t
        return out


def build_shapes(obstacles: Sequence[Obstacle]) -> ObstacleShapes:
    """The shapes of all obstacles but triangle obstacles."""
    rows: list[tuple[int, int, NDArray[np.float64], NDArray[np.float64]]] = []
    for k, obstacle in enumerate(obstacles):
        if isinstance(obstacle, HalfSpace):
            rows.append((PLANE, k, _plane_frame(np.asarray(obstacle.point), np.asarray(obstacle.normal)), np.zeros(3)))
        elif isinstance(obstacle, Sphere):
            frame = np.vstack([np.asarray(obstacle.center), np.eye(3)])
            rows.append((BOWL if obstacle.inside else BALL, k, frame, np.array([obstacle.radius, 0.0, 0.0])))
        elif isinstance(obstacle, Box):
            center, half, axes = np.asarray(obstacle.center), 0.5 * np.asarray(obstacle.size), obstacle.orientation.T
            if obstacle.inside:
                for i in range(3):
                    for side in (-1.0, 1.0):
                        rows.append(
                            (PLANE, k, _plane_frame(center + side * half[i] * axes[i], -side * axes[i]), np.zeros(3))
                        )
            else:
                rows.append((BLOCK, k, np.vstack([center, axes]), half))
    return ObstacleShapes(
        kinds=np.array([row[0] for row in rows], dtype=np.int32),
        owners=np.array([row[1] for row in rows], dtype=np.int32),
        frames=np.array([row[2] for row in rows], dtype=np.float64).reshape(-1, 4, 3),
        extents=np.array([row[3] for row in rows], dtype=np.float64).reshape(-1, 3),
        moving=np.array([obstacles[row[1]].motion is not None for row in rows], dtype=np.bool_),
    )


def _plane_frame(point: NDArray[np.float64], normal: NDArray[np.float64]) -> NDArray[np.float64]:
    """An anchor and a right-handed frame whose first axis is the normal, bit for bit."""
    helper = np.eye(3)[int(np.abs(normal).argmin())]
    second = np.cross(normal, helper)
    second /= np.linalg.norm(second)
    return np.array([point, normal, second, np.cross(normal, second)], dtype=np.float64)
