"""A ring: all points within a radius of a circle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.validators import POSITIVE, Direction, Vector
from supple.scene.obstacles.obstacle import Obstacle, lengths_and_directions
from supple.scene.obstacles.shape import frame_of

# Sides of the polyhedron along the circle, and around the tube: within 0.13 % of the outer radius, 0.5 % of the tube.
_ALONG, _AROUND = 64, 32


@dataclass(frozen=True, eq=False)
class Torus(Obstacle):
    """A solid ring: all points within `tube_radius` of a circle.

    Bodies are kept out of a polyhedron about it, within 0.13 % of the outer radius and 0.5 % of the tube's. `supple
    check` compares them with this polyhedron: a ring is not convex.

    Parameters
    ----------
    center : (3,) of the circle [m].
    axis : (3,) direction through the hole, of any length [-].
    radius : of the circle in the middle of the tube [m]; tube_radius : of the tube [m], less than `radius`.
    """

    center: Annotated[ArrayLike, Vector()] = (0.0, 0.0, 0.0)
    axis: Annotated[ArrayLike, Direction()] = (0.0, 1.0, 0.0)
    radius: Annotated[float, POSITIVE] = 0.5
    tube_radius: Annotated[float, POSITIVE] = 0.2

    kind: ClassVar[str] = "torus"
    checked_by_triangles: ClassVar[bool] = True

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.tube_radius < self.radius:
            raise SceneError(
                f"{self.label}: tube_radius is {self.tube_radius:g}, and closes the hole; give less than the radius, "
                f"{self.radius:g}"
            )

    def signed_distance(self, points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        center, axis, aside, _ = frame_of(np.asarray(self.center), np.asarray(self.axis))
        away = points - center
        _, outward = lengths_and_directions(away - (away @ axis)[:, None] * axis, aside)
        r, normals = lengths_and_directions(away - self.radius * outward, axis)
        return r - self.tube_radius, normals

    def triangles(self) -> tuple[NDArray[np.float64], NDArray[np.integer]]:
        """A polyhedron about the ring.

        Its sides touch the tube, around and along. A side between two vertices of a ring is nearer to the axis than
        these by the factor cos(pi / n): where the tube faces away from the axis, vertices are farther by as much.
        """
        angles = (np.arange(_AROUND) + 0.5) * (2.0 * np.pi / _AROUND)
        tube = self.tube_radius / np.cos(np.pi / _AROUND)
        reach = self.radius + tube * np.cos(angles)
        reach = np.where(np.cos(angles) > 0.0, reach / np.cos(np.pi / _ALONG), reach)
        along = np.arange(_ALONG) * (2.0 * np.pi / _ALONG)
        center, axis, second, third = frame_of(np.asarray(self.center), np.asarray(self.axis))
        rings = np.cos(along)[:, None] * second + np.sin(along)[:, None] * third
        points = center + reach[None, :, None] * rings[:, None, :] + (tube * np.sin(angles))[None, :, None] * axis
        i, j = np.meshgrid(np.arange(_ALONG), np.arange(_AROUND), indexing="ij")
        index, onward = i * _AROUND + j, (i + 1) % _ALONG * _AROUND + j
        above, both = i * _AROUND + (j + 1) % _AROUND, (i + 1) % _ALONG * _AROUND + (j + 1) % _AROUND
        sides = [np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((index, onward, both), (index, both, above))]
        return points.reshape(-1, 3), np.concatenate(sides)
