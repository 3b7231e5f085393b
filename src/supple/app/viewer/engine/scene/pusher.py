"""The pusher: a solid ball that follows the pointer, with a limited speed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.app.viewer.protocol.snapshots import PUSHER
from supple.scene.obstacles.obstacle import Obstacle
from supple.scene.obstacles.sphere import Sphere


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


# Longest motion in one step, as a share of the radius: otherwise the ball could jump over vertices.
STRIDE = 0.25


class Pusher:
    """A ball that moves to `target` (3,) [m].

    Attributes
    ----------
    center : (3,) at the start of the next step [m]; radius : [m]
    """

    def __init__(self, center: NDArray[np.float64], radius: float, friction: float = 0.5) -> None:
        self.center = np.array(center, dtype=np.float64)
        self.target = self.center.copy()
        self.radius = radius
        self._times = (0.0, 0.0)
        self._ends = (self.center, self.center)
        # The obstacle is placed at the origin, so that its displacement is its position.
        self.obstacle = Sphere(center=(0.0, 0.0, 0.0), radius=radius, friction=friction, motion=self.place, name=PUSHER)

    def place(self, time: float) -> NDArray[np.float64]:
        """(3,) its center at a time of the present step [m]."""
        (begin, end), (a, b) = self._times, self._ends
        if end <= begin:
            return b
        share = min(max((time - begin) / (end - begin), 0.0), 1.0)
        return a + share * (b - a)

    def begin_step(self, time: float, dt: float) -> None:
        """Set the motion from `time` to `time + dt` [s]: straight, and at most STRIDE of the radius."""
        way = self.target - self.center
        length, longest = float(np.linalg.norm(way)), STRIDE * self.radius
        if length > longest:
            way *= longest / length
        self._times = time, time + dt
        self._ends = self.center, self.center + way

    @property
    def moves(self) -> bool:
        """Whether it moves in the present step."""
        return not np.array_equal(*self._ends)

    def stay(self) -> None:
        """Do not move in the present step."""
        self._ends = self.center, self.center

    def end_step(self) -> None:
        """Take the position at the end of the step."""
        self.center = self._ends[1]
