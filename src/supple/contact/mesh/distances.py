"""Distances and nearest places of points and triangles, and of edges, of a triangle mesh; which of them touch."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.numerics.geometry.box_tree import BoxTree, overlapping
from supple.numerics.geometry.closest_points import between, closest_on_segments, closest_on_triangle, combine
from supple.numerics.mat3 import dot, row, subtract
from supple.runtime.kernel_cache import njit, prange


@njit(forceinline=True)
def point_triangle_square(x, v, triangles, t):
    """The squared distance of point v and triangle t."""
    p, a, b, c = row(x, v), row(x, triangles[t, 0]), row(x, triangles[t, 1]), row(x, triangles[t, 2])
    r = subtract(p, combine(closest_on_triangle(p, a, b, c), a, b, c))
    return dot(r, r)


@njit(forceinline=True)
def edge_edge_square(x, edges, e, f):
    """The squared distance of two edges."""
    a, b, c, d = row(x, edges[e, 0]), row(x, edges[e, 1]), row(x, edges[f, 0]), row(x, edges[f, 1])
    s, t = closest_on_segments(a, b, c, d)
    r = subtract(between(a, b, s), between(c, d, t))
    return dot(r, r)


@njit(cache=True, parallel=True)
def points_nearer(x, triangles, pairs, reach):
    """Which pairs (k, 2) of points and triangles are nearer than `reach`."""
    near = np.empty(len(pairs), dtype=np.bool_)
    for k in prange(len(pairs)):
        near[k] = point_triangle_square(x, pairs[k, 0], triangles, pairs[k, 1]) < reach * reach
    return near


@njit(cache=True, parallel=True)
def edges_nearer(x, edges, pairs, reach):
    """Which pairs (k, 2) of edges are nearer than `reach`."""
    near = np.empty(len(pairs), dtype=np.bool_)
    for k in prange(len(pairs)):
        near[k] = edge_edge_square(x, edges, pairs[k, 0], pairs[k, 1]) < reach * reach
    return near


@njit(cache=True, parallel=True)
def middles_of_points(x, triangles, pairs):
    """(k, 3) the middle between each point of pairs (k, 2) and the place on its triangle that is nearest to it."""
    out = np.empty((len(pairs), 3))
    for k in prange(len(pairs)):
        t = pairs[k, 1]
        p, a, b, c = row(x, pairs[k, 0]), row(x, triangles[t, 0]), row(x, triangles[t, 1]), row(x, triangles[t, 2])
        q = combine(closest_on_triangle(p, a, b, c), a, b, c)
        for j in range(3):
            out[k, j] = 0.5 * (p[j] + q[j])
    return out


@njit(cache=True, parallel=True)
def middles_of_edges(x, edges, pairs):
    """(k, 3) the middle between the nearest places on the two edges of each of the pairs (k, 2)."""
    out = np.empty((len(pairs), 3))
    for k in prange(len(pairs)):
        e, f = pairs[k, 0], pairs[k, 1]
        a, b, c, d = row(x, edges[e, 0]), row(x, edges[e, 1]), row(x, edges[f, 0]), row(x, edges[f, 1])
        s, t = closest_on_segments(a, b, c, d)
        p, q = between(a, b, s), between(c, d, t)
        for j in range(3):
            out[k, j] = 0.5 * (p[j] + q[j])
    return out


def boxes_of(x: NDArray[np.float64], simplices: NDArray[np.int32], margin: float) -> NDArray[np.float64]:
    """(m, 6) lowest and highest corner of simplices (m, k) of points (s, 3), enlarged by a margin [m]."""
    corners = x[simplices]
    return np.concatenate([corners.min(axis=1) - margin, corners.max(axis=1) + margin], axis=1)


def touching_pairs(
    x: NDArray[np.float64],
    triangles: NDArray[np.int32],
    edges: NDArray[np.int32],
    owner: NDArray[np.int32],
    owners: NDArray[np.bool_],
    reach: float,
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Pairs (k, 2) of points with triangles, and of edges with higher edges, that are nearer than `reach` [m].

    Pairs with a common point are left out.

    Parameters
    ----------
    x : (s, 3) [m]; owner : (s,) which thing each point belongs to; owners : (p, p) the pairs of things that count
    """
    every = np.arange(len(x), dtype=np.int32)[:, None]
    points = _pairs(boxes_of(x, every, 0.0), boxes_of(x, triangles, reach))
    corners = triangles[points[:, 1]]
    kept = owners[owner[points[:, 0]], owner[corners[:, 0]]] & (corners != points[:, :1]).all(axis=1)
    points = points[kept]
    points = points[points_nearer(x, triangles, points, reach)]
    sides = _pairs(boxes_of(x, edges, 0.0), boxes_of(x, edges, reach))
    sides = sides[sides[:, 0] < sides[:, 1]]
    one, other = edges[sides[:, 0]], edges[sides[:, 1]]
    kept = owners[owner[one[:, 0]], owner[other[:, 0]]] & (one[:, :, None] != other[:, None]).all(axis=(1, 2))
    sides = sides[kept]
    return points, sides[edges_nearer(x, edges, sides, reach)]


def _pairs(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.int32]:
    """Rows (k, 2) of boxes (m, 6) and boxes (n, 6) that overlap, in ascending order of the first."""
    start, found = overlapping(BoxTree.over(second), first)
    return np.column_stack([np.repeat(np.arange(len(first), dtype=np.int32), np.diff(start)), found])
