"""Distances and nearest places of points and triangles, and of edges, of a triangle mesh."""

from __future__ import annotations

from supple.numerics.geometry.closest_points import between, closest_on_segments, closest_on_triangle, combine
from supple.numerics.mat3 import dot, row, subtract
from supple.runtime.kernel_cache import njit


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
