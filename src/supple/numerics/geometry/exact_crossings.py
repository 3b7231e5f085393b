"""Whether two triangles of a mesh are apart, touch or cross, with exact arithmetic.

This is compiled where a pair of triangles is not clearly apart (`triangle_crossings`); most scenes never have one.
"""

from __future__ import annotations

import numpy as np

from supple.numerics.geometry.exact_predicates import side_of_line, side_of_plane
from supple.numerics.mat3 import cross, row, subtract
from supple.runtime.kernel_cache import njit, prange

APART, TOUCHING, CROSSING = 0, 1, 2


@njit
def _flat(p, axis):
    """The point without one coordinate."""
    if axis == 0:
        return (p[1], p[2])
    if axis == 1:
        return (p[2], p[0])
    return (p[0], p[1])


@njit
def _segments_meet(p, q, a, b):
    """Whether two segments of a plane, ends included, meet."""
    s, t = side_of_line(p, q, a), side_of_line(p, q, b)
    u, v = side_of_line(a, b, p), side_of_line(a, b, q)
    if s == 0 and t == 0 and u == 0 and v == 0:  # on one line
        for k in range(2):  # the boxes of the two decide
            one, other = (min(p[k], q[k]), max(p[k], q[k])), (min(a[k], b[k]), max(a[k], b[k]))
            if one[1] < other[0] or other[1] < one[0]:
                return False
        return True
    return s * t <= 0 and u * v <= 0


@njit
def _in_triangle(p, a, b, c):
    r, s, t = side_of_line(a, b, p), side_of_line(b, c, p), side_of_line(c, a, p)
    return (r >= 0 and s >= 0 and t >= 0) or (r <= 0 and s <= 0 and t <= 0)


@njit
def _coplanar_edge(p, q, a, b, c):
    """Whether the segment p q meets the triangle a b c in their common plane.

    A triangle without area counts as apart from everything; its neighbours contain its edges.
    """
    n = cross(subtract(b, a), subtract(c, a))
    axis = 0
    for k in range(1, 3):
        if abs(n[k]) > abs(n[axis]):
            axis = k
    if n[axis] == 0.0:
        return APART
    p2, q2, a2, b2, c2 = _flat(p, axis), _flat(q, axis), _flat(a, axis), _flat(b, axis), _flat(c, axis)
    if (
        _in_triangle(p2, a2, b2, c2)
        or _segments_meet(p2, q2, a2, b2)
        or _segments_meet(p2, q2, b2, c2)
        or _segments_meet(p2, q2, c2, a2)
    ):
        return TOUCHING
    return APART


@njit
def edge_and_triangle(p, q, a, b, c, at_p, at_q):
    """Whether the segment p q and the triangle a b c, both with their boundaries, are apart, touch or cross.

    `at_p`, `at_q`: sides of the triangle's plane on which the two ends are.
    """
    if at_p * at_q > 0:
        return APART
    if at_p == 0 and at_q == 0:
        return _coplanar_edge(p, q, a, b, c)
    r, s, t = side_of_plane(p, q, a, b), side_of_plane(p, q, b, c), side_of_plane(p, q, c, a)
    if r * s < 0 or s * t < 0 or r * t < 0:
        return APART
    if at_p != 0 and at_q != 0 and r != 0 and s != 0 and t != 0:
        return CROSSING
    return TOUCHING


@njit
def is_corner(i, triangle):
    return i == triangle[0] or i == triangle[1] or i == triangle[2]


@njit
def shared_corners(first, second):
    """The number of common vertices of two triangles, and one of them."""
    shared, at = 0, 0
    for k in range(3):
        if is_corner(first[k], second):
            shared, at = shared + 1, first[k]
    return shared, at


@njit
def _sides(x, one, other, out):
    """Write the side of the plane of `other` on which each corner of `one` is; returns whether all sides are equal."""
    a, b, c = row(x, other[0]), row(x, other[1]), row(x, other[2])
    for k in range(3):
        i = one[k]
        out[k] = 0 if is_corner(i, other) else side_of_plane(a, b, c, row(x, i))
    return (out[0] > 0 and out[1] > 0 and out[2] > 0) or (out[0] < 0 and out[1] < 0 and out[2] < 0)


@njit
def triangles_meet(x, first, second, sides):
    """Whether two triangles are apart, touch or cross, beside the vertices that they share.

    They are tuples of three indices into x (n, 3); `sides` (2, 3) is work space.
    """
    if shared_corners(first, second)[0] > 1:
        # Every edge of one has a vertex of the other.
        return APART
    if _sides(x, first, second, sides[0]) or _sides(x, second, first, sides[1]):
        return APART
    worst = APART
    for turn in range(2):
        one, other = (first, second) if turn == 0 else (second, first)
        for k in range(3):
            n = (k + 1) % 3
            i, j = one[k], one[n]
            if is_corner(i, other) or is_corner(j, other):
                continue
            a, b, c = row(x, other[0]), row(x, other[1]), row(x, other[2])
            found = edge_and_triangle(row(x, i), row(x, j), a, b, c, sides[turn, k], sides[turn, n])
            worst = max(worst, found)
            if worst == CROSSING:
                return worst
    return worst


@njit(cache=True, parallel=True)
def kinds_of_pairs(x, triangles, pairs, kinds):
    """Write whether the triangles of each of the pairs (k, 2) are apart, touch or cross, to kinds (k,)."""
    for k in prange(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        first = triangles[i, 0], triangles[i, 1], triangles[i, 2]
        second = triangles[j, 0], triangles[j, 1], triangles[j, 2]
        kinds[k] = triangles_meet(x, first, second, np.empty((2, 3), dtype=np.int64))
