"""Polyhedra for round surfaces."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.validators import POSITIVE, Boolean, Vector
from supple.mesh.primitives.surfaces import sphere_surface
from supple.scene.obstacles.obstacle import Obstacle, lengths_and_directions
from supple.scene.obstacles.shape import frame_of


@dataclass(frozen=True, eq=False)
class SegmentObstacle(Obstacle):
    """A body of revolution about a segment.

    Parameters
    ----------
    start, end : (3,) the ends of the axis [m]; radius : [m]; inside : True where bodies live inside.
    """

    start: Annotated[ArrayLike, Vector()] = (0.0, -0.5, 0.0)
    end: Annotated[ArrayLike, Vector()] = (0.0, 0.5, 0.0)
    radius: Annotated[float, POSITIVE] = 0.5
    inside: Annotated[bool, Boolean()] = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if np.linalg.norm(np.asarray(self.end) - np.asarray(self.start)) <= 1e-9 * self.radius:
            raise SceneError(f"{self.label}: start and end are the same point; give an axis, or use a Sphere")

    @property
    def half_length(self) -> float:
        """Of the axis [m]."""
        return 0.5 * float(np.linalg.norm(np.asarray(self.end) - np.asarray(self.start)))

    @property
    def frame(self) -> NDArray[np.float64]:
        """(4, 3) the middle of the axis [m], then three orthonormal axes; the first one leads from start to end."""
        a, b = np.asarray(self.start), np.asarray(self.end)
        return frame_of(0.5 * (a + b), (b - a) / np.linalg.norm(b - a))

    def split(
        self, points: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Heights (k,) over the middle of points (k, 3), their distances (k,) from the axis, and directions (k, 3)."""
        middle, axis, aside, _ = self.frame
        heights = (points - middle) @ axis
        return heights, *lengths_and_directions(points - middle - heights[:, None] * axis, aside)

    def placed(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points (k, 3), given in `frame`, in the world [m]."""
        return self.frame[0] + points @ self.frame[1:]


# An icosahedron's faces split into this many along each edge: faces stay within 0.4 % of the radius.
SPHERE_SPLITS = 12
# Sides of the prism for a cylinder: within 0.13 % of the radius.
CYLINDER_SIDES = 64


@cache
def round_ball(inscribed: bool) -> tuple[NDArray[np.float64], NDArray[np.integer]]:
    """A polyhedron inside of the unit ball, with its vertices on the sphere, or else one that has the ball inside."""
    # An edge of the icosahedron spans the angle arctan 2. A bit more than its share gives this number of splits.
    surface = sphere_surface(1.0, (1.0 + 1e-9) * math.atan(2.0) / SPHERE_SPLITS)
    directions, triangles = surface.vertices, surface.triangles
    corners = directions[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    nearest = np.abs(np.einsum("ij,ij->i", corners[:, 0], normals)) / np.linalg.norm(normals, axis=1)
    return directions * (1.0 if inscribed else 1.0 / float(nearest.min())), triangles


def prism(inscribed: bool, sides: int = CYLINDER_SIDES) -> tuple[NDArray[np.float64], NDArray[np.integer]]:
    """A prism about the x axis from -1 to 1, in the cylinder of radius 1 or about it; its ends are fans."""
    n = sides
    angles = np.arange(n) * (2.0 * np.pi / n)
    radius = 1.0 if inscribed else 1.0 / np.cos(np.pi / n)
    ring = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    ends = [np.column_stack([np.full(n, x), ring]) for x in (-1.0, 1.0)]
    points = np.concatenate([*ends, [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]])
    i = np.arange(n)
    j = (i + 1) % n
    walls = [np.column_stack([i, j, j + n]), np.column_stack([i, j + n, i + n])]
    caps = [np.column_stack([np.full(n, 2 * n), j, i]), np.column_stack([np.full(n, 2 * n + 1), i + n, j + n])]
    return points, np.concatenate([*walls, *caps])
