"""Everything behind a plane: a floor, a wall."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.kinds.validators import Direction, Vector
from supple.runtime.kernel_cache import njit
from supple.scene.obstacles.obstacle import Obstacle
from supple.scene.obstacles.shape import Shape, frame_of


@njit
def plane_contact(parameters, s0, s1):
    """Contact with the half-space below the first coordinate; see `Shape`."""
    return s1[0], s0[0], (1.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class HalfSpace(Obstacle):
    """Everything behind a plane: points p with (p - point) . normal < 0.

    Parameters
    ----------
    point : (3,) a point of the plane [m]; normal : (3,) direction out of the solid [-], towards the free side.
    """

    point: Annotated[ArrayLike, Vector()] = (0.0, 0.0, 0.0)
    normal: Annotated[ArrayLike, Direction()] = (0.0, 1.0, 0.0)

    kind: ClassVar[str] = "half_space"

    @property
    def plane(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return np.asarray(self.point), np.asarray(self.normal)

    def signed_distance(self, points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        point, normal = self.plane
        return (points - point) @ normal, np.tile(normal, (len(points), 1))

    def triangles(self) -> tuple[NDArray[np.float64], NDArray[np.integer]]:
        """None: a half-space is an exact plane in both solvers."""
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)

    def drawn(self, center: NDArray[np.float64], reach: float) -> tuple[NDArray[np.float64], NDArray[np.integer]]:
        point, normal = self.plane
        middle = center - normal * float((center - point) @ normal)
        _, _, a, b = frame_of(middle, normal)
        corners = middle + reach * np.array([-a - b, a - b, a + b, b - a])
        return corners, np.array([[0, 1, 2], [0, 2, 3]])

    def shapes(self) -> tuple[Shape, ...]:
        return (Shape(plane_contact, frame_of(*self.plane)),)
