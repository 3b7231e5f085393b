"""Which parts of surfaces never collide because they are stitched to each other.

What a vertex is stitched to is a triangle, an edge or a vertex. Stitched to each other are: the vertex with the
triangles that hold all of that (one, two, or those around); its corners with the triangles around the vertex; its edges
(those around, of a vertex) with the edges around the vertex. Nothing else: a neighbour of the triangle still collides.

Stitches are given as nodes (k, 4) in the surface's own numbers: the vertex, and the corners of what it is stitched to;
-1 for what is missing, or not on the surface.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

Pair = tuple[NDArray[np.int64], NDArray[np.int64]]


def stitched_triangles(nodes: NDArray[np.integer], triangles: NDArray[np.integer], n: int) -> Pair:
    """(q,) vertices and (q,) triangles that are stitched to each other; n vertices in all."""
    vertex, held = _ends(nodes, n)
    corners = _incidence(triangles, n)
    whole = (held @ corners.T).tocoo()
    inside = whole.data == held.sum(axis=1)[whole.row]
    both = (held.T @ _ones(vertex @ corners.T)).tocoo()
    first = nodes[:, 0][whole.row[inside]]
    vertices = np.concatenate([first, both.row]).astype(np.int64)
    found = np.concatenate([whole.col[inside], both.col]).astype(np.int64)
    return vertices[vertices >= 0], found[vertices >= 0]


def stitched_edges(nodes: NDArray[np.integer], edges: NDArray[np.integer], n: int) -> Pair:
    """(q,) and (q,) edges that are stitched to each other."""
    vertex, held = _ends(nodes, n)
    ends = _incidence(edges, n)
    theirs = (held @ ends.T).tocoo()
    inside = theirs.data == np.minimum(held.sum(axis=1), 2)[theirs.row]
    rows, columns = theirs.row[inside], theirs.col[inside]
    own = csr_array((np.ones(len(rows), dtype=np.int32), (rows, columns)), shape=theirs.shape)
    both = (_ones(vertex @ ends.T).T @ own).tocoo()
    return both.row.astype(np.int64), both.col.astype(np.int64)


def stitched_crossings(nodes: NDArray[np.integer], triangles: NDArray[np.integer], n: int) -> csr_array:
    """(t, t) non-zero for the triangles around a stitched vertex with those that hold all that it is stitched to."""
    vertex, held = _ends(nodes, n)
    corners = _incidence(triangles, n)
    whole = (held @ corners.T).tocoo()
    inside = whole.data == held.sum(axis=1)[whole.row]
    rows, columns = whole.row[inside], whole.col[inside]
    partners = csr_array((np.ones(len(rows), dtype=np.int32), (rows, columns)), shape=whole.shape)
    return csr_array((vertex @ corners.T).T @ partners)


def _ends(nodes: NDArray[np.integer], n: int) -> tuple[csr_array, csr_array]:
    """(k, n) each stitch's vertex, and what that is stitched to."""
    return _incidence(nodes[:, :1], n), _incidence(nodes[:, 1:], n)


def _incidence(simplices: NDArray[np.integer], n: int) -> csr_array:
    """(m, n) ones where an element has a corner."""
    rows, columns = np.nonzero(simplices >= 0)
    ones = np.ones(len(rows), dtype=np.int32)
    return _ones(csr_array((ones, (rows, simplices[rows, columns])), shape=(len(simplices), n)))


def _ones(matrix: csr_array) -> csr_array:
    """The same places, each with a one."""
    made = csr_array(matrix)
    made.sum_duplicates()
    made.data[:] = 1
    return made
