"""A capsule: all points within a radius of a segment."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from supple.numerics.geometry.convex_hull import convex_hull
from supple.runtime.kernel_cache import njit
from supple.scene.obstacles.obstacle import lengths_and_directions
from supple.scene.obstacles.polyhedra import SegmentObstacle, round_ball
from supple.scene.obstacles.shape import Shape, concave_contact


@njit
def _signed_distance(parameters, s):
    """Of the capsule about the first axis, and the normal; parameters: half length of the axis, radius."""
    half = parameters[0]
    x = s[0] - min(max(s[0], -half), half)
    r = math.sqrt(x * x + s[1] * s[1] + s[2] * s[2])
    if r == 0.0:
        return -parameters[1], (0.0, 1.0, 0.0)
    return r - parameters[1], (x / r, s[1] / r, s[2] / r)


@dataclass(frozen=True, eq=False)
class Capsule(SegmentObstacle):
    """All points within `radius` of a segment, or with `inside=True` a container of that shape.

    Parameters
    ----------
    start, end : (3,) the ends of the axis, where the round ends have their centers [m]; radius : [m].
    inside : True where bodies live inside the capsule.
    """

    kind: ClassVar[str] = "capsule"

    def signed_distance(self, points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        a, b = np.asarray(self.start), np.asarray(self.end)
        share = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        r, normals = lengths_and_directions(points - a - share[:, None] * (b - a), self.frame[2])
        return self._oriented(r - self.radius, normals)

    def triangles(self) -> tuple[NDArray[np.float64], NDArray[np.integer]]:
        return self._hull

    @cached_property
    def _hull(self) -> tuple[NDArray[np.float64], NDArray[np.integer]]:
        """Of the polyhedra of both ends."""
        ball = self.radius * round_ball(inscribed=self.inside)[0]
        ends = [ball + np.array([x, 0.0, 0.0]) for x in (-self.half_length, self.half_length)]
        points, triangles = convex_hull(np.concatenate(ends))
        return self.placed(points), triangles

    def shapes(self) -> tuple[Shape, ...]:
        if not self.inside:
            return ()
        return (Shape(concave_contact(_signed_distance), self.frame, (self.half_length, self.radius)),)
