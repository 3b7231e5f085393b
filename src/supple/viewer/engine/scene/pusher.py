"""The pusher: a solid ball that follows the pointer, and reaches it as fast as contact can bear."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.scene.obstacles.sphere import Sphere

NAME = "pusher"
# Of its radius: how far it moves in one step at most, so that it pushes vertices rather than jumping over them.
STRIDE = 0.25


class Pusher:
    """A ball on its way to `wanted` (3,) [m].

    Attributes
    ----------
    center : (3,) where it is at the beginning of the coming step [m]; radius : [m]
    """

    def __init__(self, center: NDArray[np.float64], radius: float, friction: float = 0.5) -> None:
        self.center = np.array(center, dtype=np.float64)
        self.wanted = self.center.copy()
        self.radius = radius
        self._times = (0.0, 0.0)
        self._ends = (self.center, self.center)
        # The obstacle's own place is the origin: its displacement is where it is.
        self.obstacle = Sphere(center=(0.0, 0.0, 0.0), radius=radius, friction=friction, motion=self._motion, name=NAME)

    def _motion(self, time: float) -> NDArray[np.float64]:
        (begin, end), (a, b) = self._times, self._ends
        if end <= begin:
            return b
        share = min(max((time - begin) / (end - begin), 0.0), 1.0)
        return a + share * (b - a)

    def begin_step(self, time: float, dt: float) -> None:
        """Plan the way from `time` to `time + dt` [s]: straight, and at most a stride."""
        way = self.wanted - self.center
        length, longest = float(np.linalg.norm(way)), STRIDE * self.radius
        if length > longest:
            way *= longest / length
        self._times = time, time + dt
        self._ends = self.center, self.center + way

    @property
    def moves(self) -> bool:
        """Whether it moves in the step that was begun."""
        return not np.array_equal(*self._ends)

    def stay(self) -> None:
        """Not to move in the step that was begun."""
        self._ends = self.center, self.center

    def end_step(self) -> None:
        """Stand where the step has led to."""
        self.center = self._ends[1]
