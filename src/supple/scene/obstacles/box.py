"""A solid box, or a container with six walls."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.kinds.validators import Boolean, Extents, Vector
from supple.mesh import shapes
from supple.scene.obstacles.half_space import plane_contact
from supple.scene.obstacles.obstacle import Obstacle, distances_from_corner
from supple.scene.obstacles.shape import Shape, frame_of
from supple.scene.rotation import rotation_matrix


@dataclass(frozen=True, eq=False)
class Box(Obstacle):
    """A solid box, or with `inside=True` a container that keeps bodies in.

    Parameters
    ----------
    center : (3,) [m]; size : (3,) full edge lengths [m]; rotation : (3,) rotation vector about the center [rad].
    inside : True where bodies live inside the box.
    """

    center: Annotated[ArrayLike, Vector()] = (0.0, 0.0, 0.0)
    size: Annotated[ArrayLike, Extents()] = (1.0, 1.0, 1.0)
    rotation: Annotated[ArrayLike, Vector()] = (0.0, 0.0, 0.0)
    inside: Annotated[bool, Boolean()] = False

    kind: ClassVar[str] = "box"

    @property
    def orientation(self) -> NDArray[np.float64]:
        """(3, 3) rotation from the box's own axes to the world's, at time 0."""
        return rotation_matrix(self.rotation)

    @property
    def checked_by_triangles(self) -> bool:
        return not self.inside

    def signed_distance(self, points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        R = self.orientation
        local = (points - np.asarray(self.center)) @ R
        distances, parts = distances_from_corner(np.abs(local) - 0.5 * np.asarray(self.size))
        return self._oriented(distances, (np.copysign(1.0, local) * parts) @ R.T)

    def triangles(self) -> tuple[NDArray[np.float64], NDArray[np.integer]]:
        surface = shapes.box(tuple(np.asarray(self.size, dtype=np.float64)), (1, 1, 1)).surface
        return surface.vertices @ self.orientation.T + np.asarray(self.center), surface.triangles

    def shapes(self) -> tuple[Shape, ...]:
        center, half, axes = np.asarray(self.center), 0.5 * np.asarray(self.size), self.orientation.T
        if not self.inside:
            return ()
        return tuple(
            Shape(plane_contact, frame_of(center + side * half[i] * axes[i], -side * axes[i]))
            for i in range(3)
            for side in (-1.0, 1.0)
        )
