"""Candidates for contact, kept from one search to the next while no new ones are possible."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.contact.features.pair_geometry import EDGE_EDGE, VERTEX_TRIANGLE
from supple.contact.mesh.contact_mesh import ContactMesh
from supple.contact.search.distances import edge_edge_square, point_triangle_square
from supple.contact.search.patch_search import PatchSearch
from supple.numerics.inner_product import inner
from supple.runtime.kernel_cache import njit, prange

# Margins are this share of the present motion, between these shares of dhat and of the mean edge: points that move
# little do not need a new search for several steps, and points that move far need one for any margin.
_SHARE, _LEAST, _MOST = 0.5, 0.5, 0.1
# Points that are nearer to a straight way than this share of the margin are on it.
_ON_WAY = 0.25


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
        of_points = nearer(points, VERTEX_TRIANGLE, mesh.triangles, mesh.edges, self.vertex_triangle, reach)
        of_edges = nearer(points, EDGE_EDGE, mesh.triangles, mesh.edges, self.edge_edge, reach)
        return Candidates(self.vertex_triangle[of_points], self.edge_edge[of_edges])


class CandidateFinder:
    """Finds what is near what on a surface that moves.

    `_near` holds all pairs that come nearer than dhat while no point moves by more than `_margin` from `_reference`,
    apart from a common motion. `_wide` holds those that come nearer than dhat + 2 * `_wide_margin` along the latest
    way.

    Parameters
    ----------
    dhat : [m] candidates are pairs that may be nearer than this

    Attributes
    ----------
    mesh : the surface
    """

    def __init__(self, mesh: ContactMesh, dhat: float) -> None:
        self.mesh, self._dhat = mesh, dhat
        self._patches = PatchSearch(mesh.parts, mesh.patches)
        edge = float(mesh.edge_lengths.mean()) if len(mesh.edge_lengths) else 0.0
        self._margins = _LEAST * dhat, max(_LEAST * dhat, _MOST * edge)
        self._margin = self._wide_margin = -1.0
        self._reference = self._begin = self._way = np.zeros((len(mesh.points), 3))
        self._near = self._wide = Candidates(np.zeros((0, 2), np.int32), np.zeros((0, 2), np.int32))
        if not mesh.collide[np.ix_(np.unique(mesh.owner), np.unique(mesh.owner))].any():  # half-spaces have no points
            self._margin = np.inf

    def find(self, begin: NDArray[np.float64], end: NDArray[np.float64]) -> Candidates:
        """Every pair that may come nearer than dhat while points move straight from `begin` (s, 3) to `end`, and more.

        The pairs with a common point, pairs that may not touch, and stitched pairs are left out.
        """
        return self._near if self._covers(begin) and self._covers(end) else self._search(begin, end - begin)

    def at(self, points: NDArray[np.float64]) -> Candidates:
        """Every pair that is nearer than dhat at `points` (s, 3), and more; see `find`."""
        if self._covers(points):
            return self._near
        off = _distance_from_way(points, self._begin, self._way)
        if off <= _ON_WAY * self._wide_margin:
            self._keep_near(points, self._wide_margin - off)
            return self._near
        return self._search(points, np.zeros_like(points))

    def _search(self, begin: NDArray[np.float64], way: NDArray[np.float64]) -> Candidates:
        """The candidates along a way, which become `_wide`; those at its beginning become `_near`."""
        longest = _farthest(begin + way, begin)
        least, most = self._margins
        margin = min(max(_SHARE * longest, least), most)
        found = Candidates(*map(_ascending, self._patches.find(begin, way, self._dhat + 2.0 * margin)))
        self._wide, self._begin, self._way, self._wide_margin = found, begin.copy(), way, margin
        if longest > margin:
            self._keep_near(begin, margin)
        else:
            self._near, self._reference, self._margin = found, self._begin, margin
        return found

    def _keep_near(self, points: NDArray[np.float64], margin: float) -> None:
        self._near = self._wide.nearer_than(self.mesh, points, self._dhat + 2.0 * margin)
        self._reference, self._margin = points.copy(), margin

    def _covers(self, points: NDArray[np.float64]) -> bool:
        """Whether `_near` has all candidates at `points`."""
        return self._margin == np.inf or (self._margin >= 0.0 and _farthest(points, self._reference) <= self._margin)


@njit(cache=True)
def _farthest(x, y):
    """The largest distance of points x (s, 3) from y, apart from the mean motion [m]; infinite where not finite."""
    a = b = c = 0.0
    for i in range(len(x)):
        a, b, c = a + (x[i, 0] - y[i, 0]), b + (x[i, 1] - y[i, 1]), c + (x[i, 2] - y[i, 2])
    a, b, c = a / len(x), b / len(x), c / len(x)
    most = 0.0
    for i in range(len(x)):
        square = (x[i, 0] - y[i, 0] - a) ** 2 + (x[i, 1] - y[i, 1] - b) ** 2 + (x[i, 2] - y[i, 2] - c) ** 2
        if not square <= most:
            most = square if square < np.inf else np.inf
    return math.sqrt(most)


def _ascending(pairs: NDArray[np.int32]) -> NDArray[np.int32]:
    keys = np.sort(pairs[:, 0].astype(np.int64) << 32 | pairs[:, 1])
    return np.stack([keys >> 32, keys & 0xFFFFFFFF], axis=1).astype(np.int32)


def _distance_from_way(x: NDArray[np.float64], begin: NDArray[np.float64], way: NDArray[np.float64]) -> float:
    """The largest distance of a point from its place at the moment of a common motion that suits all best [m]."""
    moved = x - begin
    square = inner(way, way)
    part = min(max(inner(moved, way) / square, 0.0), 1.0) if square > 0.0 else 0.0
    moved -= part * way
    return float(np.sqrt(np.einsum("ij,ij->i", moved, moved).max(initial=0.0)))


@njit(cache=True, parallel=True)
def nearer(x, kind, triangles, edges, pairs, reach):
    """Which pairs (k, 2) of points and triangles, or of edges, are nearer than `reach`."""
    near = np.empty(len(pairs), dtype=np.bool_)
    for k in prange(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        square = edge_edge_square(x, edges, i, j) if kind == EDGE_EDGE else point_triangle_square(x, i, triangles, j)
        near[k] = square < reach * reach
    return near
