"""Pairs that do not collide because they are stitched to each other.

Excluded are the pairs of `supple.scene.stitches.masks`. Excluded are also pairs with a stitched point that touch at the
start, between things that are stitched to each other: halves stitched face to face touch everywhere.

Of welds, excluded are the pairs of the rigid body with the welded points and their neighbours that are nearer at the
start than the longest edge there: welded points stay where they are on the rigid body, and their neighbours near it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from supple.contact.search.patch_search import pairs_nearer
from supple.contact.search.patches import Parts, Patches
from supple.numerics.adjacency import Adjacency, adjacency, no_lists
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


Mesh = tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32], Patches]


class WeldedPoints(NamedTuple):
    """Points (w,) of the mesh that are welded, and the pairs (k, 2) of things that welds join."""

    points: NDArray[np.int32]
    joined: NDArray[np.int64]


def stitch_filter(
    mesh: Mesh,
    nodes: NDArray[np.int32],
    start: NDArray[np.float64],
    owner: NDArray[np.int32],
    collide: NDArray[np.bool_],
    welded: WeldedPoints | None = None,
    touching: float | None = None,
) -> StitchFilter:
    """Of stitches with nodes (k, 4) in the mesh's numbers, -1 for none, and of welds.

    Parameters
    ----------
    mesh : triangles (f, 3), edges (e, 2), triangle_edges (f, 3), patches, see `ContactMesh`
    start : (s, 3) where the points are at the start [m]; owner : (s,) which thing each belongs to
    collide : (p, p) which owners may touch; touching : what is nearer at the start touches [m]
    """
    triangles, edges, triangle_edges, _ = mesh
    s, e, f = len(owner), len(edges), len(triangles)
    points, faces = stitched_triangles(nodes, triangles, s)
    one, other = stitched_edges(nodes, edges, s)
    lengths = np.linalg.norm(start[edges[:, 1]] - start[edges[:, 0]], axis=1)
    stitched = np.zeros(s, dtype=np.bool_)
    stitched[nodes[nodes >= 0]] = True
    joined = np.zeros_like(collide)
    for k in range(1, nodes.shape[1]):
        both = (nodes[:, 0] >= 0) & (nodes[:, k] >= 0)
        joined[owner[nodes[both, 0]], owner[nodes[both, k]]] = True
    joined = (joined | joined.T) & collide
    near = [_near(mesh, start, joined, touching or _TOUCHING * float(lengths.mean()), stitched, np.any)]
    if welded is not None:
        marked = np.zeros(s, dtype=np.bool_)
        marked[welded.points] = True
        ring = marked[edges].any(axis=1)
        marked[edges[ring]] = True
        joined = np.zeros_like(collide)
        joined[tuple(welded.joined.T)] = True
        near.append(_near(mesh, start, joined | joined.T, float(lengths[ring].max(initial=0.0)), marked, np.all))
    near_triangles, near_edges = (np.concatenate(kind) for kind in zip(*near, strict=True))
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


def _near(
    mesh: Mesh,
    x: NDArray[np.float64],
    joined: NDArray[np.bool_],
    reach: float,
    marked: NDArray[np.bool_],
    of: Callable[..., Any],
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Pairs (k, 2) of points with triangles, and of edges with edges, of owners that are joined, nearer than `reach`.

    One of both is a marked point, or any or all (`of`) of its points are marked.
    """
    triangles, edges, _, patches = mesh
    parts = Parts(np.arange(len(x), dtype=np.int32), triangles, edges, joined, no_lists(len(x)), no_lists(len(edges)))
    faces, sides = pairs_nearer(np.ascontiguousarray(x), parts, patches, reach)
    marked_triangles, marked_edges = of(marked[triangles], axis=1), of(marked[edges], axis=1)
    return faces[marked[faces[:, 0]] | marked_triangles[faces[:, 1]]], sides[marked_edges[sides].any(axis=1)]
