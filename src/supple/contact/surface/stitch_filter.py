"""Pairs that do not collide because they are stitched to each other.

Excluded are the pairs of `supple.scene.stitches.masks`. Excluded are also pairs with a stitched point that touch at the
start, between things that are stitched to each other: halves stitched face to face touch everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from supple.contact.surface.touching import touching_pairs
from supple.numerics.adjacency import Adjacency, adjacency
from supple.scene.stitches.masks import stitched_crossings, stitched_edges, stitched_triangles

# Parts that are nearer than this share of the mean edge at the start touch.
_TOUCHING = 1e-6


@dataclass(frozen=True, eq=False)
class StitchFilter:
    """Pairs of parts of a mesh that never collide.

    Attributes
    ----------
    triangles_of_point : the triangles that a point does not collide with
    edges_of_edge : the edges that an edge does not collide with; each pair is in the lists of both
    crossing : for each triangle the higher ones that may cross it: triangles around a stitched point with its partner,
        and triangles whose parts touch at the start
    """

    triangles_of_point: Adjacency
    edges_of_edge: Adjacency
    crossing: Adjacency


def stitch_filter(
    mesh: tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]],
    nodes: NDArray[np.int32],
    start: NDArray[np.float64],
    owner: NDArray[np.int32],
    collide: NDArray[np.bool_],
) -> StitchFilter:
    """Of stitches with nodes (k, 4) in the mesh's numbers, -1 for none.

    Parameters
    ----------
    mesh : triangles (f, 3), edges (e, 2), triangle_edges (f, 3), see `ContactMesh`
    start : (s, 3) where the points are at the start [m]; owner : (s,) which thing each belongs to
    collide : (p, p) which owners may touch
    """
    triangles, edges, triangle_edges = mesh
    s, e, f = len(owner), len(edges), len(triangles)
    points, faces = stitched_triangles(nodes, triangles, s)
    one, other = stitched_edges(nodes, edges, s)
    near_triangles, near_edges = _touching(mesh, nodes, start, owner, collide)
    crossing = stitched_crossings(nodes, triangles, s)
    crossing = crossing + _crossings((triangles, triangle_edges), near_triangles, near_edges, (s, e))
    t, u = crossing.nonzero()
    return StitchFilter(
        adjacency(np.append(points, near_triangles[:, 0]), np.append(faces, near_triangles[:, 1]), s),
        adjacency(
            np.concatenate([one, other, *near_edges.T]),
            np.concatenate([other, one, *near_edges[:, ::-1].T]),
            e,
        ),
        adjacency(np.minimum(t, u), np.maximum(t, u), f),
    )


def _crossings(
    sides: tuple[NDArray[np.int32], NDArray[np.int32]],
    near_triangles: NDArray[np.int32],
    near_edges: NDArray[np.int32],
    sizes: tuple[int, int],
) -> csr_array:
    """(f, f) non-zero for pairs of triangles to which a pair of a point and a triangle, or of two edges, belongs."""
    s, e = sizes
    f = len(sides[0])

    def incidence(rows: NDArray[np.integer], columns: NDArray[np.integer], shape: tuple[int, int]) -> csr_array:
        return csr_array((np.ones(len(rows), dtype=np.int32), (rows, columns)), shape=shape)

    each = np.repeat(np.arange(f), 3)
    corners, edges = incidence(each, sides[0].ravel(), (f, s)), incidence(each, sides[1].ravel(), (f, e))
    near = incidence(near_triangles[:, 1], near_triangles[:, 0], (f, s)) @ corners.T
    return csr_array(near + edges @ incidence(near_edges[:, 0], near_edges[:, 1], (e, e)) @ edges.T)


def _touching(
    mesh: tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]],
    nodes: NDArray[np.int32],
    start: NDArray[np.float64],
    owner: NDArray[np.int32],
    collide: NDArray[np.bool_],
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Pairs (k, 2) of points with triangles, and of edges with edges, that touch at the start; see the module."""
    triangles, edges, _ = mesh
    reach = _TOUCHING * float(np.linalg.norm(start[edges[:, 1]] - start[edges[:, 0]], axis=1).mean())
    stitched = np.zeros(len(owner), dtype=np.bool_)
    stitched[nodes[nodes >= 0]] = True
    joined = np.zeros_like(collide)
    for k in range(1, nodes.shape[1]):
        both = (nodes[:, 0] >= 0) & (nodes[:, k] >= 0)
        one, other = owner[nodes[both, 0]], owner[nodes[both, k]]
        joined[one, other] = joined[other, one] = True
    near_triangles, near_edges = touching_pairs(start, triangles, edges, owner, joined & collide, reach)
    of_triangles = stitched[near_triangles[:, 0]] | stitched[triangles[near_triangles[:, 1]]].any(axis=1)
    of_edges = stitched[edges[near_edges]].any(axis=(1, 2))
    return near_triangles[of_triangles], near_edges[of_edges]
