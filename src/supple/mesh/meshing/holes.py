"""Closing the holes of a surface that have a simple rim, each with the best triangulation of its rim."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from supple.mesh.surface import SurfaceMesh
from supple.mesh.topology import facet_keys

# The work grows with the third power of the number: 300 edges take about a second.
LONGEST_RIM = 300
# A triangle whose height is below this share of its longest side is as bad as one without area.
_THINNEST = 1e-4


def close_holes(surface: SurfaceMesh, open_edges: NDArray[np.int32]) -> tuple[SurfaceMesh, int]:
    """The surface with triangles in all holes of at most 300 edges, and the number of these holes.

    A hole is closed by the triangles between the vertices of its rim that have the smallest sum of area and squared
    sides (dynamic programming as of Barequet, Sharir, "Filling gaps in the boundary of a polyhedron", 1995, section
    3). It is left open where its rim meets itself or lies
    along another rim. Whether the result intersects itself is for the caller to check.

    Parameters
    ----------
    open_edges : (k, 2) the edges of one triangle, of a consistently oriented surface
    """
    rims, existing = _rims(surface.triangles, open_edges), facet_keys(surface.triangles, len(surface.vertices))
    added = []
    for rim, seam in zip(rims, _are_seams(surface.vertices, rims), strict=True):
        rows = None if seam else _patch(surface.vertices, rim)
        # The back of a triangle is not a patch.
        if rows is not None and not np.isin(facet_keys(rows, len(surface.vertices)), existing).any():
            added.append(rows)
    if not added:
        return surface, 0
    return SurfaceMesh(surface.vertices, np.concatenate([surface.triangles, *added])), len(added)


def _are_seams(vertices: NDArray[np.float64], rims: list[list[int]]) -> list[bool]:
    """Which rims lie along another one, nearer than their edges are long: both are to be joined, not closed each."""
    seams = []
    for k, rim in enumerate(rims):
        others = [vertex for j, other in enumerate(rims) if j != k for vertex in other]
        edge = np.linalg.norm(vertices[rim] - np.roll(vertices[rim], 1, axis=0), axis=1).mean()
        near = KDTree(vertices[others]).query(vertices[rim])[0] if others else np.array([np.inf])
        seams.append(bool(near.min() < edge))
    return seams


def _rims(triangles: NDArray[np.int32], open_edges: NDArray[np.int32]) -> list[list[int]]:
    """Closed chains of vertices along open edges, in the direction that triangles inside need."""
    wanted = {tuple(edge) for edge in np.sort(open_edges, axis=1).tolist()}
    after: dict[int, int] = {}
    twice = set()
    for a, b in np.concatenate([triangles, np.roll(triangles, -1, axis=1)]).reshape(2, -1).T.tolist():
        if (min(a, b), max(a, b)) in wanted:
            if b in after:
                twice.add(b)
            after[b] = a
    rims = []
    while after:
        start, vertex = after.popitem()
        rim = [start]
        while vertex != start and vertex in after:
            rim.append(vertex)
            vertex = after.pop(vertex)
        if vertex == start and not twice.intersection(rim):
            rims.append(rim)
    return rims


def _patch(vertices: NDArray[np.float64], rim: list[int]) -> NDArray[np.int32] | None:
    """Triangles (n - 2, 3) between the n vertices of a rim; None where none are of use."""
    n = len(rim)
    if not 3 <= n <= LONGEST_RIM:
        return None
    x = vertices[rim]
    squares = ((x[:, None] - x[None]) ** 2).sum(axis=2)
    cost, middle = np.full((n, n), np.inf), np.zeros((n, n), dtype=np.int64)
    cost[np.arange(n - 1), np.arange(1, n)] = 0.0
    for length in range(2, n):
        for i in range(n - length):
            k = i + length
            between = np.arange(i + 1, k)
            doubled = np.linalg.norm(np.cross(x[between] - x[i], x[k] - x[i]), axis=1)
            sides = squares[i, between] + squares[between, k] + squares[i, k]
            own = np.where(doubled > _THINNEST * sides, doubled + sides, np.inf)
            total = cost[i, between] + cost[between, k] + own
            best = int(total.argmin())
            cost[i, k], middle[i, k] = total[best], between[best]
    if not np.isfinite(cost[0, n - 1]):
        return None
    rows, open_spans = [], [(0, n - 1)]
    while open_spans:
        i, k = open_spans.pop()
        if k - i > 1:
            j = int(middle[i, k])
            rows.append((rim[i], rim[j], rim[k]))
            open_spans += [(i, j), (j, k)]
    return np.array(rows, dtype=np.int32)
