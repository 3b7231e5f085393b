"""What a search takes: the parts of surfaces that may touch, and their division into patches.

A patch is a group of neighbouring triangles of one thing. Every point and every edge belongs to the first patch that
has it. Searches compare patches, then what patches own.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.numerics.adjacency import Adjacency, adjacency
from supple.numerics.sparse.partition import bisected_groups

# Triangles of a patch. With 8 or 32, searches of `bears` take 10 to 20 % longer.
PATCH = 16


class Parts(NamedTuple):
    """Points, triangles and edges of surfaces, as kernels take them.

    Attributes
    ----------
    nodes : (s,) the row of each point in the array of places; triangles : (f, 3), edges : (e, 2) of such rows
    collide : (p, p) which owners may touch
    excluded_triangles : of each point, excluded_edges : of each edge, what it never touches (see `StitchFilter`)
    """

    nodes: NDArray[np.int32]
    triangles: NDArray[np.int32]
    edges: NDArray[np.int32]
    collide: NDArray[np.bool_]
    excluded_triangles: Adjacency
    excluded_edges: Adjacency


class Patches(NamedTuple):
    """q patches: the owner (q,) of each, and its triangles, edges and points.

    Attributes
    ----------
    corners : all points of a patch's triangles
    of_point, of_triangle, of_edge : (s,), (f,), (e,) the patch of each part
    """

    owner: NDArray[np.int32]
    triangles: Adjacency
    edges: Adjacency
    points: Adjacency
    corners: Adjacency
    of_point: NDArray[np.int32]
    of_triangle: NDArray[np.int32]
    of_edge: NDArray[np.int32]


def patches_of(
    triangles: NDArray[np.int32], triangle_edges: NDArray[np.int32], owner: NDArray[np.int32], rest: NDArray[np.float64]
) -> Patches:
    """Groups of triangles (f, 3) with edges (f, 3), by the owners (s,) of points and their places at rest (s, 3)."""
    own = owner[triangles[:, 0]]
    groups = bisected_groups(rest[triangles].mean(axis=1), own, max(1, -(-len(own) // PATCH)))
    q = len(groups)
    of_triangle = np.empty(len(own), dtype=np.int32)
    for number, group in enumerate(groups):
        of_triangle[group] = number
    of_edge = _first(triangle_edges, of_triangle, int(triangle_edges.max(initial=-1)) + 1)
    of_point = _first(triangles, of_triangle, len(owner))
    return Patches(
        np.array([own[group[0]] for group in groups], dtype=np.int32),
        adjacency(of_triangle, np.arange(len(own)), q),
        adjacency(of_edge, np.arange(len(of_edge)), q),
        adjacency(of_point, np.arange(len(owner)), q),
        adjacency(np.repeat(of_triangle, 3), triangles.ravel(), q),
        of_point,
        of_triangle,
        of_edge,
    )


def _first(parts: NDArray[np.int32], patch: NDArray[np.int32], count: int) -> NDArray[np.int32]:
    """(count,) the lowest patch of the triangles that have each part (f, 3)."""
    out = np.full(count, len(patch), dtype=np.int32)
    np.minimum.at(out, parts.ravel(), np.repeat(patch, 3))
    return out
