"""All pairs of triangles with a common point: a tree of their boxes, cheap tests, then exact ones of what remains."""

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
from supple.numerics.geometry.exact_crossings import APART, CROSSING, TOUCHING, kinds_of_pairs, shared_corners
from supple.numerics.geometry.vertex_stars import simple_stars
from supple.numerics.mat3 import cross, dot, row, subtract
from supple.runtime.kernel_cache import njit, prange

__all__ = ["APART", "CROSSING", "TOUCHING", "crossing_triangles"]

# Triangles are divided into this many runs, whatever the number of threads.
_RUNS = 64
# Of the rounding error of a determinant of differences, relative to the sum of its products' magnitudes: far above it.
_ERROR = 1e-14


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
def _beside_plane(x, one, other):
    """Whether all corners of a triangle, but for a shared one, are on one side of the other's plane, by more than
    round-off."""
    a = row(x, other[0])
    u, v = subtract(row(x, other[1]), a), subtract(row(x, other[2]), a)
    n = cross(u, v)
    size = (abs(u[0]) + abs(u[1]) + abs(u[2])) * (abs(v[0]) + abs(v[1]) + abs(v[2]))
    above = below = True
    for k in range(3):
        if one[k] == other[0] or one[k] == other[1] or one[k] == other[2]:
            continue
        w = subtract(row(x, one[k]), a)
        height, margin = dot(n, w), _ERROR * size * (abs(w[0]) + abs(w[1]) + abs(w[2]))
        above, below = above and height > margin, below and height < -margin
    return above or below


@njit
def _clearly_apart(x, first, second, shared, at):
    """Whether rounded numbers show that two triangles with at most one common vertex are otherwise apart."""
    if shared == 0:
        if _between_centers(x, first, second):
            return True
    elif _beside_corner(x, first, second, at):
        return True
    return _beside_plane(x, first, second) or _beside_plane(x, second, first)


@njit
def _near_of_run(r, x, triangles, rules, ignored, tree, found):
    """Write the pairs of every `_RUNS`-th block, in it and with later ones, as far as they fit; returns how many.

    Only pairs that are not clearly apart; see `_near_pairs`.
    """
    owner, collide, simple = rules
    nodes, labels, order = tree
    first_row, last_row, pairs = found
    leaves = len(nodes) // 2
    size = min(GROUP, leaves)
    blocks = leaves // size
    # The tree of which the blocks are the leaves.
    upper = nodes[: 2 * blocks]
    stack = np.empty(STACK, dtype=np.int64)
    boxes = np.empty((6, GROUP))
    # Where the tree has fewer leaves than a block, the last boxes overlap nothing.
    boxes[:] = np.nan
    count = 0
    for one in range(r, blocks, _RUNS):
        label = labels[blocks + one]
        if label >= 0 and collide[label, label]:
            label = -1
        box = upper[blocks + one]
        top = after_leaf(upper, one, box, stack)
        other = one
        while other >= 0:
            begin = other * size
            for k in range(size):
                for j in range(6):
                    boxes[j, k] = nodes[leaves + begin + k, j]
            for q in range(one * size, min((one + 1) * size, len(order))):
                if not overlap(nodes, blocks + other, nodes[leaves + q]):
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
                    second = triangles[j, 0], triangles[j, 1], triangles[j, 2]
                    shared, at = shared_corners(first, second)
                    if shared > 1 or (shared == 1 and simple[at]) or not collide[owner[i], owner[j]]:
                        continue
                    low, high = min(i, j), max(i, j)
                    if in_list(ignored, low, high) or _clearly_apart(x, first, second, shared, at):
                        continue
                    if first_row + count < last_row:
                        pairs[first_row + count, 0], pairs[first_row + count, 1] = low, high
                    count += 1
            other, top = next_leaf(upper, labels, box, label, False, stack, top)
    return count


@njit(cache=True, parallel=True, rows=2_000)
def _near_pairs(x, triangles, rules, ignored, tree, room, pairs, counts):
    """The pairs of triangles that are not clearly apart, of all runs; rows room[r] .. room[r + 1] are for run r."""
    owner, collide, simple = rules
    start, items = ignored
    nodes, labels, order = tree
    for r in prange(_RUNS):
        # Numba takes no tuples into a parallel loop.
        its_rules, its_tree = (owner, collide, simple), (nodes, labels, order)
        found = room[r], room[r + 1], pairs
        counts[r] = _near_of_run(r, x, triangles, its_rules, (start, items), its_tree, found)


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
    most : no more pairs than this are returned, the first ones; -1: no limit
    ignored : pairs that are not tested, as starts (t + 1,) and the higher rows for each lower one

    Returns
    -------
    pairs (k, 2), kinds (k,): TOUCHING, or CROSSING where an edge passes through the inside of a triangle.
    """
    pairs = np.zeros((0, 2), dtype=np.int64)
    if len(triangles):
        tree = BoxTree.over(boxes_of_triangles(x, triangles), owner.astype(np.int32))
        none = np.zeros(len(triangles) + 1, dtype=np.int32)
        lists = (none, none[:0]) if ignored is None else (ignored[0], ignored[1])
        rules = owner, collide, simple_stars(x, triangles)
        pairs = _pairs_of(x, triangles, rules, lists, (tree.nodes, tree.labels, tree.order))
    kinds = np.zeros(len(pairs), dtype=np.int8)
    if len(pairs):
        pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
        kinds_of_pairs(x, triangles, pairs, kinds)
    meeting = np.flatnonzero(kinds)[: most if most >= 0 else None]
    return pairs[meeting], kinds[meeting]


def _pairs_of(x: NDArray[np.float64], triangles: NDArray[np.int32], *lists: tuple) -> NDArray[np.int64]:
    """(k, 2) the pairs of triangles that are not clearly apart; see `_near_pairs`."""
    counts = np.full(_RUNS, 64, dtype=np.int64)
    while True:
        room = np.concatenate([[0], np.cumsum(counts)])
        pairs = np.zeros((room[-1], 2), dtype=np.int64)
        _near_pairs(x, triangles, *lists, room, pairs, counts)
        if (counts <= np.diff(room)).all():
            return np.concatenate([pairs[first : first + count] for first, count in zip(room, counts, strict=False)])
