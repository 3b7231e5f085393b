"""Poses of scripted obstacles at the beginning and the end of a substep."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from supple.scene.obstacles.obstacle import Obstacle


class ObstaclePoses:
    """Rotations (k, 3, 3) and translations (k, 3) [m] of k obstacles, at one time. Each time is evaluated once."""

    def __init__(self, obstacles: Sequence[Obstacle]) -> None:
        self.obstacles = tuple(obstacles)
        self.moving = np.array([obstacle.motion is not None for obstacle in self.obstacles], dtype=np.bool_)
        self._recent: dict[float, tuple[NDArray[np.float64], NDArray[np.float64]]] = {}

    def at(self, time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Rotations and translations at `time` [s]; read only."""
        if not self.moving.any():
            time = 0.0
        if time not in self._recent:
            if len(self._recent) >= 4:
                self._recent.pop(next(iter(self._recent)))
            self._recent[time] = self._evaluate(time)
        return self._recent[time]

    def _evaluate(self, time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        R = np.tile(np.eye(3), (len(self.obstacles), 1, 1))
        t = np.zeros((len(self.obstacles), 3))
        for k in np.flatnonzero(self.moving):
            R[k], t[k] = self.obstacles[k].pose(time)
        return R, t
