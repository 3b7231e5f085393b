"""Pairs of parts of a surface that may be near each other: points with triangles, and edges with edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.contact_mesh import ContactMesh
from supple.contact.mesh.distances import edges_nearer, points_nearer


@dataclass(frozen=True, eq=False)
class Candidates:
    """Pairs in an order that depends on the input alone.

    Attributes
    ----------
    vertex_triangle : (k, 2) int32 points and triangles, ascending
    edge_edge : (l, 2) int32 edges, the lower first, ascending
    """

    vertex_triangle: NDArray[np.int32]
    edge_edge: NDArray[np.int32]

    def __len__(self) -> int:
        return len(self.vertex_triangle) + len(self.edge_edge)

    def nearer_than(self, mesh: ContactMesh, points: NDArray[np.float64], reach: float) -> Candidates:
        """The pairs whose distance at `points` (s, 3) is below `reach` [m]."""
        of_points = points_nearer(points, mesh.triangles, self.vertex_triangle, reach)
        of_edges = edges_nearer(points, mesh.edges, self.edge_edge, reach)
        return Candidates(self.vertex_triangle[of_points], self.edge_edge[of_edges])

    def joined(self, other: Candidates) -> Candidates:
        """These pairs, then others."""
        if len(other) == 0:
            return self
        return Candidates(
            np.concatenate([self.vertex_triangle, other.vertex_triangle]),
            np.concatenate([self.edge_edge, other.edge_edge]),
        )
