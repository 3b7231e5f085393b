"""A rigid triangle mesh."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from supple.kinds.validators import Instance
from supple.mesh.surface import SurfaceMesh
from supple.numerics.geometry.triangle_tree import TriangleTree, closest_places
from supple.scene.obstacles.obstacle import Obstacle, lengths_and_directions


@dataclass(frozen=True, eq=False)
class TriangleObstacle(Obstacle):
    """A rigid triangle mesh. A closed one is solid; an open one is a two-sided sheet.

    Parameters
    ----------
    surface : the triangles, where they are at time 0 [m].
    """

    surface: Annotated[SurfaceMesh | None, Instance((SurfaceMesh,), "a SurfaceMesh")] = None

    kind: ClassVar[str] = "triangles"
    required: ClassVar[tuple[str, ...]] = ("surface",)

    @property
    def surface_mesh(self) -> SurfaceMesh:
        assert self.surface is not None  # checked when it was made
        return self.surface

    def signed_distance(self, points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """A closed mesh must face outwards; the distance from an open sheet is above zero on both sides."""
        surface = self.surface_mesh
        rows, distances = self._tree.nearest(points)
        corners = surface.vertices[surface.triangles[rows]]
        places = closest_places(points, surface.vertices, surface.triangles[rows])
        away = points - np.einsum("ki,kij->kj", places, corners)
        facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        facing /= np.linalg.norm(facing, axis=1)[:, None]
        _, normals = lengths_and_directions(away, np.zeros(3))
        normals = np.where((distances > 0.0)[:, None], normals, facing)
        sides = np.where(np.einsum("ij,ij->i", away, facing) < 0.0, -1.0, 1.0)
        if not self._is_closed:
            return distances, normals
        return sides * distances, np.where((distances > 0.0)[:, None], sides[:, None] * normals, facing)

    def triangles(self) -> tuple[NDArray[np.float64], NDArray[np.integer]]:
        return self.surface_mesh.vertices, self.surface_mesh.triangles

    @cached_property
    def _tree(self) -> TriangleTree:
        return TriangleTree.of(self.surface_mesh.vertices, self.surface_mesh.triangles)

    @cached_property
    def _is_closed(self) -> bool:
        t = self.surface_mesh.triangles
        edges = np.sort(np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]), axis=1)
        return bool((np.unique(edges, axis=0, return_counts=True)[1] == 2).all())
