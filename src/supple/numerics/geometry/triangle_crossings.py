"""All pairs of triangles with a common point: a tree of their boxes, then exact tests of the pairs it finds."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from supple.numerics.adjacency import in_list
from supple.numerics.geometry.box_tree import (
    GROUP,
    STACK,
    BoxTree,
    after_leaf,
    boxes_of_triangles,
    next_leaf,
    overlap,
    which_overlap,
)
from supple.numerics.geometry.exact_predicates import side_of_line, side_of_plane
from supple.numerics.geometry.vertex_stars import simple_stars
from supple.numerics.mat3 import cross, dot, row, subtract
from supple.runtime.kernel_cache import njit, prange

APART, TOUCHING, CROSSING = 0, 1, 2

# Triangles are divided into this many runs, whatever the number of threads.
_RUNS = 64


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
def _is_corner(i, triangle):
    return i == triangle[0] or i == triangle[1] or i == triangle[2]


@njit
def _sides(x, one, other, out):
    """Write the side of the plane of `other` on which each corner of `one` is; returns whether all sides are equal."""
    a, b, c = row(x, other[0]), row(x, other[1]), row(x, other[2])
    for k in range(3):
        i = one[k]
        out[k] = 0 if _is_corner(i, other) else side_of_plane(a, b, c, row(x, i))
    return (out[0] > 0 and out[1] > 0 and out[2] > 0) or (out[0] < 0 and out[1] < 0 and out[2] < 0)


@njit
def _to_center(x, triangle, origin):
    """Three times the way from a place to the center of a triangle."""
    a, b = subtract(row(x, triangle[0]), origin), subtract(row(x, triangle[1]), origin)
    c = subtract(row(x, triangle[2]), origin)
    return (a[0] + b[0] + c[0], a[1] + b[1] + c[1], a[2] + b[2] + c[2])


@njit
def _unit(v):
    length = math.sqrt(dot(v, v))
    return (v[0] / length, v[1] / length, v[2] / length) if length > 0.0 else v


@njit
def _between_centers(x, first, second):
    """Whether a plane normal to the line between the centers of two triangles without common vertices separates them,
    by more than round-off. This separates nearly all of them, in a small part of the time of the exact test."""
    o = row(x, first[0])
    b, c = subtract(row(x, first[1]), o), subtract(row(x, first[2]), o)
    p, q, r = subtract(row(x, second[0]), o), subtract(row(x, second[1]), o), subtract(row(x, second[2]), o)
    d = (
        b[0] + c[0] - (p[0] + q[0] + r[0]),
        b[1] + c[1] - (p[1] + q[1] + r[1]),
        b[2] + c[2] - (p[2] + q[2] + r[2]),
    )
    least, most = min(0.0, dot(d, b), dot(d, c)), max(dot(d, p), dot(d, q), dot(d, r))
    size = max(_size(b), _size(c), _size(p), _size(q), _size(r))
    return least - most > 1e-12 * (abs(d[0]) + abs(d[1]) + abs(d[2])) * size


@njit
def _size(v):
    return max(abs(v[0]), abs(v[1]), abs(v[2]))


@njit
def _beside_corner(x, first, second, at):
    """Whether a plane through the one common vertex `at` of two triangles separates them, by more than round-off.

    It is halfway between the directions to both centers, and the other vertices must be clearly on their sides.
    """
    origin = row(x, at)
    d = subtract(_unit(_to_center(x, first, origin)), _unit(_to_center(x, second, origin)))
    least, most, size = np.inf, -np.inf, 0.0
    for k in range(3):
        if first[k] != at:
            u = subtract(row(x, first[k]), origin)
            least, size = min(least, dot(d, u)), max(size, _size(u))
        if second[k] != at:
            v = subtract(row(x, second[k]), origin)
            most, size = max(most, dot(d, v)), max(size, _size(v))
    margin = 1e-12 * (abs(d[0]) + abs(d[1]) + abs(d[2])) * size
    return least > margin and most < -margin


@njit
def _shared(first, second):
    """The number of common vertices of two triangles, and one of them."""
    shared, at = 0, 0
    for k in range(3):
        if _is_corner(first[k], second):
            shared, at = shared + 1, first[k]
    return shared, at


@njit
def triangles_meet(x, first, second, sides):
    """Whether two triangles are apart, touch or cross, beside the vertices that they share.

    They are tuples of three indices into x (n, 3); `sides` (2, 3) is work space.
    """
    shared, at = _shared(first, second)
    # Where they share an edge, every edge of one has a vertex of the other.
    if shared > 1:
        return APART
    if _between_centers(x, first, second) if shared == 0 else _beside_corner(x, first, second, at):
        return APART
    if _sides(x, first, second, sides[0]) or _sides(x, second, first, sides[1]):
        return APART
    worst = APART
    for turn in range(2):
        one, other = (first, second) if turn == 0 else (second, first)
        for k in range(3):
            n = (k + 1) % 3
            i, j = one[k], one[n]
            if _is_corner(i, other) or _is_corner(j, other):
                continue
            a, b, c = row(x, other[0]), row(x, other[1]), row(x, other[2])
            found = edge_and_triangle(row(x, i), row(x, j), a, b, c, sides[turn, k], sides[turn, n])
            worst = max(worst, found)
            if worst == CROSSING:
                return worst
    return worst


@njit(error_model="numpy")
def _crossings_of_run(r, x, triangles, owner, collide, ignored, tree, simple, most, pairs, kinds):
    """Write the pairs of every `_RUNS`-th block, in it and with later ones, as far as they fit; returns how many."""
    nodes, labels, _ = tree
    leaves = len(nodes) // 2
    blocks = max(1, leaves // GROUP)
    # The tree of which the blocks are the leaves.
    upper = nodes[: 2 * blocks]
    stack = np.empty(STACK, dtype=np.int64)
    # Where the tree has fewer leaves than a block, the last boxes overlap nothing.
    scratch = np.zeros((2, 3), dtype=np.int64), np.full((6, GROUP), np.nan)
    count = 0
    for one in range(r, blocks, _RUNS):
        label = labels[blocks + one]
        if label >= 0 and collide[label, label]:
            label = -1
        box = upper[blocks + one]
        top = after_leaf(upper, one, box, stack)
        other = one
        while other >= 0:
            count = _crossings_of_blocks(
                one, other, x, triangles, owner, collide, ignored, tree, simple, most, scratch, count, pairs, kinds
            )
            if count == most:
                return count
            other, top = next_leaf(upper, labels, box, label, False, stack, top)
    return count


@njit(error_model="numpy")
def _crossings_of_blocks(
    one, other, x, triangles, owner, collide, ignored, tree, simple, most, scratch, count, pairs, kinds
):
    """Write the pairs of triangles of two blocks, or of one, after `count` pairs; returns the number of all."""
    nodes, _, order = tree
    sides, boxes = scratch
    leaves = len(nodes) // 2
    size = min(GROUP, leaves)
    whole, begin = leaves // size + other, other * size
    for k in range(size):
        for j in range(6):
            boxes[j, k] = nodes[leaves + begin + k, j]
    for q in range(one * size, min((one + 1) * size, len(order))):
        box = nodes[leaves + q]
        if not overlap(nodes, whole, box):
            continue
        meets = which_overlap(nodes, leaves + q, boxes)
        if meets >> max(q + 1 - begin, 0) == 0:
            continue
        i = order[q]
        first = triangles[i, 0], triangles[i, 1], triangles[i, 2]
        for leaf in range(max(q + 1, begin), min(begin + size, len(order))):
            if not (meets >> (leaf - begin)) & 1:
                continue
            j = order[leaf]
            low, high = min(i, j), max(i, j)
            second = triangles[j, 0], triangles[j, 1], triangles[j, 2]
            shared, at = _shared(first, second)
            if shared > 1 or (shared == 1 and simple[at]):
                continue
            if not collide[owner[i], owner[j]] or in_list(ignored, low, high):
                continue
            kind = triangles_meet(x, first, second, sides)
            if kind == APART:
                continue
            if count < len(pairs):
                pairs[count, 0], pairs[count, 1] = low, high
                kinds[count] = kind
            count += 1
            if count == most:
                return count
    return count


@njit(cache=True, parallel=True, error_model="numpy")
def _crossings(x, triangles, owner, collide, ignored, tree, simple, most, room, pairs, kinds, counts):
    """The pairs of all runs, of which rows room[r] .. room[r + 1] are for run r; see `crossing_triangles`."""
    start, items = ignored
    nodes, labels, order = tree
    for r in prange(_RUNS):
        first, last = room[r], room[r + 1]
        its = pairs[first:last], kinds[first:last]
        counts[r] = _crossings_of_run(
            r, x, triangles, owner, collide, (start, items), (nodes, labels, order), simple, most, its[0], its[1]
        )


def crossing_triangles(
    x: NDArray[np.float64],
    triangles: NDArray[np.int32],
    owner: NDArray[np.int32],
    collide: NDArray[np.bool_],
    most: int = -1,
    ignored: tuple[NDArray[np.int32], NDArray[np.int32]] | None = None,
) -> tuple[NDArray[np.int64], NDArray[np.int8]]:
    """Pairs of triangles with common points other than shared vertices, in ascending order, lower row first.

    Parameters
    ----------
    x : (n, 3) [m]; triangles : (t, 3); owner : (t,) number of the object of each triangle
    collide : (p, p) which pairs of objects are tested; the diagonal: triangles of one object with each other
    most : the search ends after this many pairs; -1: no limit
    ignored : pairs that are not tested, as starts (t + 1,) and the higher rows for each lower one

    Returns
    -------
    pairs (k, 2), kinds (k,): TOUCHING, or CROSSING where an edge passes through the inside of a triangle.
    """
    if len(triangles) == 0:
        return np.zeros((0, 2), dtype=np.int64), np.zeros(0, dtype=np.int8)
    tree = BoxTree.over(boxes_of_triangles(x, triangles), owner.astype(np.int32))
    arrays = tree.nodes, tree.labels, tree.order
    none = np.zeros(len(triangles) + 1, dtype=np.int32)
    lists = (none, none[:0]) if ignored is None else (ignored[0], ignored[1])
    simple = simple_stars(x, triangles)
    counts = np.full(_RUNS, 64, dtype=np.int64)
    while True:
        room = np.concatenate([[0], np.cumsum(counts)])
        pairs, kinds = np.zeros((room[-1], 2), dtype=np.int64), np.zeros(room[-1], dtype=np.int8)
        _crossings(x, triangles, owner, collide, lists, arrays, simple, most, room, pairs, kinds, counts)
        if (counts <= np.diff(room)).all():
            break
    found = np.concatenate([np.arange(first, first + count) for first, count in zip(room, counts, strict=False)])
    pairs, kinds = pairs[found], kinds[found]
    ascending = np.lexsort((pairs[:, 1], pairs[:, 0]))
    if most >= 0:
        ascending = ascending[:most]
    return pairs[ascending], kinds[ascending]
