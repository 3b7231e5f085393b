"""Parts of surfaces that never collide because they are stitched to each other.

The partner of a stitched vertex is a triangle, an edge or a vertex. These pairs are stitched to each other: the vertex
with the triangles that contain its whole partner; the corners of the partner with the triangles around the vertex; and
the edges of the partner (of a vertex: the edges around it) with the edges around the stitched vertex. All other pairs
collide, also the stitched vertex with a neighbour of its triangle.

Stitches are given as nodes (k, 4) in the surface's own numbers: the vertex, and the corners of its partner; -1 for a
corner that does not exist or is not on the surface.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

Pair = tuple[NDArray[np.int64], NDArray[np.int64]]


def stitched_triangles(nodes: NDArray[np.integer], triangles: NDArray[np.integer], n: int) -> Pair:
    """(q,) vertices and (q,) triangles that are stitched to each other; n vertices in all."""
    vertex, partner = _ends(nodes, n)
    corners = _incidence(triangles, n)
    whole = _containing(partner, corners, 3).tocoo()
    both = (partner.T @ _ones(vertex @ corners.T)).tocoo()
    vertices = np.concatenate([nodes[:, 0][whole.row], both.row]).astype(np.int64)
    found = np.concatenate([whole.col, both.col]).astype(np.int64)
    return vertices[vertices >= 0], found[vertices >= 0]


def stitched_edges(nodes: NDArray[np.integer], edges: NDArray[np.integer], n: int) -> Pair:
    """(q,) and (q,) edges that are stitched to each other."""
    vertex, partner = _ends(nodes, n)
    ends = _incidence(edges, n)
    both = (_ones(vertex @ ends.T).T @ _containing(partner, ends, 2)).tocoo()
    return both.row.astype(np.int64), both.col.astype(np.int64)


def stitched_crossings(nodes: NDArray[np.integer], triangles: NDArray[np.integer], n: int) -> csr_array:
    """(t, t) non-zero for the triangles around a stitched vertex with those that contain its whole partner."""
    vertex, partner = _ends(nodes, n)
    corners = _incidence(triangles, n)
    return csr_array((vertex @ corners.T).T @ _containing(partner, corners, 3))


def _containing(partner: csr_array, simplices: csr_array, most: int) -> csr_array:
    """(k, m) ones for the simplices that contain all corners of a partner, or `most` of them."""
    common = (partner @ simplices.T).tocoo()
    inside = common.data == np.minimum(partner.sum(axis=1), most)[common.row]
    places = common.row[inside], common.col[inside]
    return csr_array((np.ones(len(places[0]), dtype=np.int32), places), shape=common.shape)


def _ends(nodes: NDArray[np.integer], n: int) -> tuple[csr_array, csr_array]:
    """(k, n) the vertex of each stitch, and the corners of its partner."""
    return _incidence(nodes[:, :1], n), _incidence(nodes[:, 1:], n)


def _incidence(simplices: NDArray[np.integer], n: int) -> csr_array:
    """(m, n) ones where a simplex has a corner."""
    rows, columns = np.nonzero(simplices >= 0)
    ones = np.ones(len(rows), dtype=np.int32)
    return _ones(csr_array((ones, (rows, simplices[rows, columns])), shape=(len(simplices), n)))


def _ones(matrix: csr_array) -> csr_array:
    """Ones at the non-zero places of a matrix."""
    ones = csr_array(matrix)
    ones.sum_duplicates()
    ones.data[:] = 1
    return ones
