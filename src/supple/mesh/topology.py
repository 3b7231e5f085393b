"""What follows from the indices of a mesh alone, such as unique edges and components; merging of equal vertices."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.errors import MeshError
from supple.mesh.checked_arrays import frozen

# Facet k of a positive tet lies opposite its vertex k and is counter-clockwise seen from outside.
TET_FACETS = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
TET_EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])


class Components(NamedTuple):
    """Connected pieces: their number, and the piece (0 .. count - 1) of each element."""

    count: int
    labels: NDArray[np.int32]


def edge_keys(simplices: NDArray[np.integer], n_vertices: int) -> NDArray[np.int64]:
    """One 64-bit key, lower vertex * n + higher vertex, for each edge of each simplex: (m, edges per simplex)."""
    width = simplices.shape[1]
    pairs = TET_EDGES if width == 4 else np.array([[0, 1], [1, 2], [2, 0]])
    corners = simplices.astype(np.int64)
    first, second = corners[:, pairs[:, 0]], corners[:, pairs[:, 1]]
    return np.minimum(first, second) * n_vertices + np.maximum(first, second)


def are_edges(triangles: NDArray[np.integer]) -> NDArray[np.bool_]:
    """(t,) which triangles are edges of rods: their last two corners are the same."""
    return np.asarray(triangles[:, 1] == triangles[:, 2])


def unique_edges(simplices: NDArray[np.int32], n_vertices: int) -> NDArray[np.int32]:
    """Edges (e, 2) int32 of triangles or tets, each once, lower vertex first, in lexicographic order.

    Triangles whose last two corners are the same, edges of rods, have one.
    """
    # In a quarter of the time of `np.unique` for millions of keys.
    ordered = np.sort(edge_keys(simplices, n_vertices), axis=None)
    first = np.ones(len(ordered), dtype=bool)
    np.not_equal(ordered[1:], ordered[:-1], out=first[1:])
    keys = ordered[first]
    keys = keys[keys % (n_vertices + 1) != 0]  # from a vertex to itself
    return np.ascontiguousarray(np.column_stack(np.divmod(keys, n_vertices)).astype(np.int32))


def facet_keys(triangles: NDArray[np.integer], n_vertices: int) -> NDArray[np.int64]:
    """One 64-bit key for each triangle (m, 3), independent of the order of its corners."""
    low, middle, high = np.sort(triangles, axis=1).astype(np.int64).T
    if n_vertices < 2**21:
        return (low * n_vertices + middle) * n_vertices + high
    # Three indices do not fit into 63 bits: number the pairs first.
    _, rank = np.unique(low * n_vertices + middle, return_inverse=True)
    return rank.astype(np.int64) * n_vertices + high


def has_vertex_twice(simplices: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Which elements (m,) have the same vertex at two corners."""
    corners = np.sort(simplices, axis=1)
    return (corners[:, 1:] == corners[:, :-1]).any(axis=1)


def repeats_another(triangles: NDArray[np.integer], n_vertices: int) -> NDArray[np.bool_]:
    """Which triangles (m,) have the vertices of an earlier one, and face the same way."""
    a, b, c = triangles.astype(np.int64).T
    faces = np.sign(b - a) * np.sign(c - b) * np.sign(a - c) > 0
    keys = facet_keys(triangles, n_vertices)
    _, first = np.unique(np.where(faces, keys, -1 - keys), return_index=True)
    repeats = np.ones(len(triangles), dtype=bool)
    repeats[first] = False
    return repeats


def is_used(simplices: NDArray[np.integer], n_vertices: int) -> NDArray[np.bool_]:
    """Which vertices (n,) some element has."""
    used = np.zeros(n_vertices, dtype=bool)
    used[simplices] = True
    return used


def without_unused(
    vertices: NDArray[np.float64], simplices: NDArray[np.integer]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The vertices that some element has, in their order, and the elements as rows of these."""
    used = is_used(simplices, len(vertices))
    return vertices[used], (np.cumsum(used) - 1)[simplices]


def graph_components(n: int, first: NDArray[np.integer], second: NDArray[np.integer]) -> NDArray[np.int32]:
    """The connected piece of each of n nodes (n,), where edge k joins first[k] and second[k]."""
    from scipy.sparse import coo_array, csgraph

    graph = coo_array((np.ones(len(first), dtype=np.bool_), (first, second)), shape=(n, n))
    return csgraph.connected_components(graph.tocsr(), directed=False)[1]


def connected_components(simplices: NDArray[np.int32], n_vertices: int) -> Components:
    """Pieces of a mesh; elements that share a vertex are connected."""
    first = np.repeat(simplices[:, 0], simplices.shape[1] - 1)
    of_vertex = graph_components(n_vertices, first, simplices[:, 1:].ravel())
    # Vertices that no element uses would count as pieces of their own; renumber by the elements alone.
    used, labels = np.unique(of_vertex[simplices[:, 0]], return_inverse=True)
    return Components(len(used), frozen(labels.astype(np.int32)))


def tet_neighbours(tets: NDArray[np.int32], n_vertices: int) -> NDArray[np.int32]:
    """Neighbour (m, 4) of each tet across the facet opposite each of its vertices; -1 on the boundary.

    Raises
    ------
    MeshError : where three tets or more share a facet.
    """
    keys = np.concatenate([facet_keys(tets[:, facet], n_vertices) for facet in TET_FACETS])
    # Position in `keys` is facet * m + tet.
    order = np.argsort(keys, kind="stable")
    ordered = keys[order]
    same = ordered[1:] == ordered[:-1]
    overlapping = same[1:] & same[:-1]
    m = len(tets)
    if overlapping.any():
        k = int(np.flatnonzero(overlapping)[0])
        facet, tet = divmod(int(order[k]), m)
        owners = sorted(int(t) % m for t in order[k : k + 3])
        corners = sorted(tets[tet, TET_FACETS[facet]].tolist())
        raise MeshError(
            f"TetMesh: tets {owners[0]}, {owners[1]} and {owners[2]} all share the facet {corners}; a facet can have "
            "two tets at most, so some of them overlap: remove them or remesh"
        )
    first, second = order[:-1][same], order[1:][same]
    neighbour = np.full(4 * m, -1, dtype=np.int32)
    neighbour[first] = second % m
    neighbour[second] = first % m
    return np.ascontiguousarray(neighbour.reshape(4, m).T)


def merge_map(points: NDArray[np.float64], tolerance: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Which points to keep, and for each point the row among the kept ones that replaces it.

    Points are joined when they are equal, or within `tolerance` [m] of each other (also over a chain of such
    neighbours). The first of each group keeps its place.
    """
    keep, index = _equal(points)
    if tolerance <= 0.0 or len(keep) < 2:
        return keep, index
    from scipy.spatial import KDTree

    close = KDTree(points[keep]).query_pairs(tolerance, output_type="ndarray")
    if len(close) == 0:
        return keep, index
    first, second_index = _first_of_each(graph_components(len(keep), *close.T))
    return keep[first], second_index[index]


def _equal(points: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    points = points + 0.0  # turns -0 into 0
    order = np.lexsort(points.T)
    new = np.ones(len(points), dtype=bool)
    new[1:] = (points[order][1:] != points[order][:-1]).any(axis=1)
    group = np.empty(len(points), dtype=np.int64)
    group[order] = np.cumsum(new) - 1
    return _first_of_each(group)


def _first_of_each(group: NDArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First row of each group, in the order of rows; and for each row the position of its group in that order."""
    _, first, inverse = np.unique(group, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(len(first), dtype=np.int64)
    rank[order] = np.arange(len(first))
    return first[order], rank[inverse]
