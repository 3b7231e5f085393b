"""A cylinder with flat ends."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from supple.runtime.kernel_cache import njit
from supple.scene.obstacles.obstacle import distances_from_corner
from supple.scene.obstacles.polyhedra import SegmentObstacle, prism
from supple.scene.obstacles.shape import Shape, concave_contact


@njit
def _signed_distance(parameters, s):
    """Of the cylinder about the first axis, and the normal; parameters: half length, radius."""
    r = math.sqrt(s[1] * s[1] + s[2] * s[2])
    beyond, aside = abs(s[0]) - parameters[0], r - parameters[1]
    sign = math.copysign(1.0, s[0])
    u, v = (s[1] / r, s[2] / r) if r > 0.0 else (1.0, 0.0)
    a, b = max(beyond, 0.0), max(aside, 0.0)
    d = math.sqrt(a * a + b * b)
    if d > 0.0:
        return d, (sign * a / d, u * b / d, v * b / d)
    if beyond > aside:
        return beyond, (sign, 0.0, 0.0)
    return aside, (0.0, u, v)


@dataclass(frozen=True, eq=False)
class Cylinder(SegmentObstacle):
    """A solid cylinder with flat ends, or with `inside=True` a container of that shape.

    Parameters
    ----------
    start, end : (3,) the centers of the flat ends [m]; radius : [m].
    inside : True where bodies live inside the cylinder.
    """

    kind: ClassVar[str] = "cylinder"

    def signed_distance(self, points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        heights, r, outward = self.split(points)
        beyond = np.column_stack([np.abs(heights) - self.half_length, r - self.radius])
        distances, parts = distances_from_corner(beyond)
        normals = (parts[:, 0] * np.copysign(1.0, heights))[:, None] * self.frame[1] + parts[:, 1:] * outward
        return self._oriented(distances, normals)

    def triangles(self) -> tuple[NDArray[np.float64], NDArray[np.integer]]:
        points, triangles = prism(inscribed=self.inside)
        return self.placed(points * [self.half_length, self.radius, self.radius]), triangles

    def shapes(self) -> tuple[Shape, ...]:
        if not self.inside:
            return ()
        return (Shape(concave_contact(_signed_distance), self.frame, (self.half_length, self.radius)),)
