"""A solid ball, or a bowl."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.kinds.validators import POSITIVE, Boolean, Vector
from supple.numerics.mat3 import dot
from supple.runtime.kernel_cache import njit
from supple.scene.obstacles.obstacle import Obstacle, lengths_and_directions
from supple.scene.obstacles.polyhedra import round_ball
from supple.scene.obstacles.shape import Shape, concave_contact


@njit
def _signed_distance(parameters, s):
    """Of the ball with radius parameters[0] about the origin, and the normal."""
    r = math.sqrt(dot(s, s))
    if r == 0.0:
        return -parameters[0], (0.0, 1.0, 0.0)
    return r - parameters[0], (s[0] / r, s[1] / r, s[2] / r)


@dataclass(frozen=True, eq=False)
class Sphere(Obstacle):
    """A solid ball, or with `inside=True` a bowl that keeps bodies in.

    Parameters
    ----------
    center : (3,) [m]; radius : [m]; inside : True where bodies live inside the sphere.
    """

    center: Annotated[ArrayLike, Vector()] = (0.0, 0.0, 0.0)
    radius: Annotated[float, POSITIVE] = 1.0
    inside: Annotated[bool, Boolean()] = False

    kind: ClassVar[str] = "sphere"

    def signed_distance(self, points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        r, normals = lengths_and_directions(points - np.asarray(self.center), np.array([0.0, 1.0, 0.0]))
        return self._oriented(r - self.radius, normals)

    def triangles(self) -> tuple[NDArray[np.float64], NDArray[np.integer]]:
        points, triangles = round_ball(inscribed=self.inside)
        return np.asarray(self.center) + self.radius * points, triangles

    def shapes(self) -> tuple[Shape, ...]:
        if not self.inside:
            return ()
        frame = np.vstack([np.asarray(self.center), np.eye(3)])
        return (Shape(concave_contact(_signed_distance), frame, (self.radius,)),)
