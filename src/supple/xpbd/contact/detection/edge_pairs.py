"""The pairs of sharp edges that may touch, from the triangles near the middles of edges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.contact.search.spatial_hash import PairFinder
from supple.contact.search.surfaces import ContactSurfaces
from supple.xpbd.contact.detection.edge_contacts import list_edge_pairs
from supple.xpbd.contact.detection.sharp_edges import SharpEdges

_EDGE_BITS = (1 << 31) - 1


class EdgePairs:
    """Pairs of edges, renewed after every search. In a search, the middles of edges follow the points.

    Attributes
    ----------
    keys : (k,) of the pairs, ascending
    """

    def __init__(
        self,
        edges: SharpEdges,
        surfaces: ContactSurfaces,
        stitched: tuple[NDArray[np.int64], NDArray[np.int32]],
    ) -> None:
        self.edges = edges
        self.pieces = surfaces.point_piece[edges.ends[:, 0]]
        self.arrays = (edges.ends, edges.opposite)
        self._surfaces = (surfaces.point_piece, surfaces.triangle_piece, surfaces.allowed, surfaces.gaps)
        self._stitched = stitched
        self._found = np.zeros(1024, dtype=np.int64)
        self.keys = np.zeros(0, dtype=np.int64)
        self._first = self._second = np.zeros(0, dtype=np.int32)
        self.smallest = np.zeros(0)

    def __len__(self) -> int:
        return len(self.edges.ends)

    def search_from(self, x: NDArray[np.float64], far: NDArray[np.float64], gap: NDArray[np.float64]) -> None:
        """Write the middles of all edges behind the points into x, and their search radii into far.

        Parameters
        ----------
        x, far : (n + e, 3) see `find_pairs`; the first n rows are given [m]
        gap : (n,) largest gap that a point keeps [m]
        """
        n = len(x) - len(self)
        a, b = self.edges.ends.T
        x[n:] = 0.5 * (x[a] + x[b])
        half = 0.5 * np.linalg.norm(x[b] - x[a], axis=1)
        far[n:, 0] = half + np.maximum(far[a, 1], far[b, 1]) + gap[a]

    def renew(self, x: NDArray[np.float64], finder: PairFinder, far: NDArray[np.float64]) -> None:
        """Read the lists of the finder, after a search from `search_from`."""
        n = len(x) - len(self)
        a, b = self.edges.ends.T
        reach = np.maximum(far[a, 1], far[b, 1])
        lists = (finder.n_active, finder.active, finder.starts, finder.triangles)
        topology = (self.arrays, self.edges.triangles, self.edges.of_triangles)
        while True:
            count = list_edge_pairs(x, lists, n, *topology, self._surfaces, self._stitched, reach, self._found)
            if count <= len(self._found):
                break
            self._found = np.zeros(2 * count, dtype=np.int64)
        self.keys = np.unique(self._found[:count])
        self._first = ((self.keys >> 31) & _EDGE_BITS).astype(np.int32)
        self._second = (self.keys & _EDGE_BITS).astype(np.int32)
        self.smallest = np.full(len(self.keys), np.inf)

    def numbered(self, rows: NDArray[np.int64]) -> tuple:
        """The argument `pairs` of `find_edge_contacts`, for these rows."""
        return self._first, self._second, rows
