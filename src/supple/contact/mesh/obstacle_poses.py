"""Poses of scripted obstacles at the beginning and the end of a substep."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.scene.inputs import Input
from supple.scene.obstacles.obstacle import Obstacle


class ObstaclePoses:
    """Rotations (k, 3, 3) and translations (k, 3) [m] of k obstacles, at one time. Each time is evaluated once."""

    def __init__(self, obstacles: Sequence[Obstacle]) -> None:
        self.obstacles = tuple(obstacles)
        self.moving = np.array([obstacle.motion is not None for obstacle in self.obstacles], dtype=np.bool_)
        self._inputs = [one.motion for one in self.obstacles if isinstance(one.motion, Input)]
        self._recent: dict[tuple[Any, ...], tuple[NDArray[np.float64], NDArray[np.float64]]] = {}

    def at(self, time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Rotations and translations at `time` [s]; read only."""
        if not self.moving.any():
            time = 0.0
        key = (time, *(given.ramp for given in self._inputs))  # where an input was set anew, its poses are others
        if key not in self._recent:
            if len(self._recent) >= 4:
                self._recent.pop(next(iter(self._recent)))
            self._recent[key] = self._evaluate(time)
        return self._recent[key]

    def _evaluate(self, time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        R = np.tile(np.eye(3), (len(self.obstacles), 1, 1))
        t = np.zeros((len(self.obstacles), 3))
        for k in np.flatnonzero(self.moving):
            R[k], t[k] = self.obstacles[k].pose(time)
        return R, t
