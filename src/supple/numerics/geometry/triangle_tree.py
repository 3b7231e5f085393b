"""Triangles near points: a tree of bounding boxes over triangles.

Edges and vertices are triangles with equal corners, (a, b, b) and (a, a, a).

Source: Ericson, "Real-Time Collision Detection" (2005), section 6.2.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.numerics.geometry.box_tree import boxes_of_triangles
from supple.numerics.geometry.closest_points import area_normal, closest_on_triangle, combine
from supple.numerics.mat3 import copy_elements, dot, row, subtract
from supple.runtime.kernel_cache import njit, prange, read_only

_LEAF = 4
_DEPTH = 64  # of a balanced tree; more than any memory can hold
# Squared distances that differ by less than the fraction TIE are equal. So are distances that differ by less than the
# fraction ROUND_OFF of the coordinates. A point above a common edge is then equally near to both triangles, also far
# from the origin.
TIE, ROUND_OFF = 1e-12, 1e-14
# Cosines between normals that agree to this are equal.
SAME_FACING = 1e-6


class TriangleTree(NamedTuple):
    """A balanced tree. Node i has the children 2 i + 1 and 2 i + 2; the last level are the leaves.

    Attributes
    ----------
    points : (n, 3) [m]; triangles : (t, 3), at least one
    order : (t,) the triangles, leaf by leaf; bounds : (nodes, 2) first and last + 1 row of `order` of each node
    boxes : (nodes, 6) lowest and highest coordinates [m]
    """

    points: NDArray[np.float64]
    triangles: NDArray[np.int32]
    order: NDArray[np.int64]
    bounds: NDArray[np.int64]
    boxes: NDArray[np.float64]

    @classmethod
    def of(cls, points: NDArray[np.float64], triangles: NDArray[np.int32]) -> TriangleTree:
        """Build the tree, in O(t log^2 t)."""
        points = read_only(np.asarray(points, dtype=np.float64))
        triangles = read_only(np.asarray(triangles, dtype=np.int32))
        boxes = boxes_of_triangles(points, triangles)
        levels = max(0, int(np.ceil(np.log2(max(1, len(triangles)) / _LEAF))))
        return cls(points, triangles, *_build(boxes, levels))

    def nearest(
        self, queries: NDArray[np.float64], within: float = np.inf, normals: NDArray[np.float64] | None = None
    ) -> tuple[NDArray, NDArray]:
        """The nearest triangle to each point, within a distance.

        Among several equally near triangles (up to round-off), the one from whose plane the point is farthest wins.
        Among these, the one whose normal is most opposed to that of the point wins, and then the lowest number.

        Parameters
        ----------
        queries : (q, 3) [m]; within : [m]
        normals : (q, 3) unit normals of the surface that the points belong to, zero where none exists

        Returns
        -------
        triangles : (q,) int64, -1 where none is within the distance; distances : (q,) [m], inf there.
        """
        found = np.full(len(queries), -1, dtype=np.int64)
        squares = np.full(len(queries), np.inf)
        queries = np.ascontiguousarray(queries, dtype=np.float64)
        own = np.zeros_like(queries) if normals is None else np.ascontiguousarray(normals, dtype=np.float64)
        _nearest(queries, own, within, *self, found, squares)
        return found, np.sqrt(squares)

    def all_within(self, queries: NDArray[np.float64], within: float) -> tuple[NDArray, NDArray, NDArray]:
        """All triangles within a distance of each point.

        Returns
        -------
        queries, triangles : (k,) int64, sorted; distances : (k,) [m]
        """
        queries = np.ascontiguousarray(queries, dtype=np.float64)
        counts = np.zeros(len(queries), dtype=np.int64)
        nothing = np.zeros(0, dtype=np.int64)
        _all_within(queries, within, *self, counts, nothing, nothing, np.zeros(0))
        starts = np.concatenate([[0], np.cumsum(counts)])
        found, squares = np.empty(starts[-1], dtype=np.int64), np.empty(starts[-1])
        _all_within(queries, within, *self, counts, starts, found, squares)
        of_query = np.repeat(np.arange(len(queries)), counts)
        order = np.lexsort((found, of_query))
        return of_query[order], found[order], np.sqrt(squares[order])


@njit(cache=True)
def _build(boxes, levels):
    nodes = (1 << (levels + 1)) - 1
    order = np.arange(len(boxes))
    bounds = np.zeros((nodes, 2), dtype=np.int64)
    bounds[0, 1] = len(boxes)
    out = np.empty((nodes, 6))
    for node in range(nodes):
        low, high = bounds[node, 0], bounds[node, 1]
        for k in range(3):
            out[node, k], out[node, 3 + k] = np.inf, -np.inf
        for p in range(low, high):
            for k in range(3):
                out[node, k] = min(out[node, k], boxes[order[p], k])
                out[node, 3 + k] = max(out[node, 3 + k], boxes[order[p], 3 + k])
        left = 2 * node + 1
        if left >= nodes:
            continue
        axis = 0
        for k in range(1, 3):
            if out[node, 3 + k] - out[node, k] > out[node, 3 + axis] - out[node, axis]:
                axis = k
        part = order[low:high].copy()
        middle = boxes[part, axis] + boxes[part, 3 + axis]
        copy_elements(part[np.argsort(middle, kind="mergesort")], order[low:high])
        half = low + (high - low + 1) // 2
        bounds[left, 0], bounds[left, 1] = low, half
        bounds[left + 1, 0], bounds[left + 1, 1] = half, high
    return order, bounds, out


@njit
def _square_to_box(p, boxes, node):
    total = 0.0
    for k in range(3):
        off = max(max(boxes[node, k] - p[k], p[k] - boxes[node, 3 + k]), 0.0)
        total += off * off
    return total


@njit
def _corners(points, triangles, t):
    return row(points, triangles[t, 0]), row(points, triangles[t, 1]), row(points, triangles[t, 2])


@njit
def _square_to_triangle(p, points, triangles, t):
    a, b, c = _corners(points, triangles, t)
    off = subtract(p, combine(closest_on_triangle(p, a, b, c), a, b, c))
    return dot(off, off)


def pair_distances(
    queries: NDArray[np.float64], points: NDArray[np.float64], triangles: NDArray[np.int32]
) -> NDArray[np.float64]:
    """Distances (k,) [m] from the queries (k, 3) to the triangles (k, 3) of the same rows, indices of points (n, 3)."""
    weights = closest_places(queries, points, triangles)
    off = queries - sum(weights[:, k, None] * points[triangles[:, k]] for k in range(3))
    return np.sqrt((off * off).sum(axis=1))


def closest_places(
    queries: NDArray[np.float64], points: NDArray[np.float64], triangles: NDArray[np.int32]
) -> NDArray[np.float64]:
    """(k, 3) barycentric coordinates of the point of the k-th triangle that is nearest to the k-th query."""
    out = np.empty((len(queries), 3))
    _closest_places(np.ascontiguousarray(queries), np.ascontiguousarray(points), np.ascontiguousarray(triangles), out)
    return out


@njit(cache=True)
def _closest_places(queries, points, triangles, out):
    for k in range(len(queries)):
        out[k, 0], out[k, 1], out[k, 2] = closest_on_triangle(row(queries, k), *_corners(points, triangles, k))


@njit
def _square_height(p, points, triangles, t, normal):
    """Square of the distance from the triangle's plane, and the cosine between its normal and another one; 0, 0 for a
    triangle without area."""
    a, b, c = _corners(points, triangles, t)
    n = area_normal(a, b, c)
    area = dot(n, n)
    if area == 0.0:
        return 0.0, 0.0
    return dot(n, subtract(p, a)) ** 2 / area, dot(n, normal) / np.sqrt(area)


@njit
def _slack(square, p, largest):
    """The uncertainty of a squared distance from p."""
    off = ROUND_OFF * max(largest, abs(p[0]), abs(p[1]), abs(p[2]))
    return TIE * square + off * (2.0 * np.sqrt(square) + off)


@njit
def _comes_first(p, normal, points, triangles, t, best, largest):
    """Whether triangle t is preferred to `best`, which is equally near."""
    if best < 0:
        return True
    one, facing = _square_height(p, points, triangles, t, normal)
    other, facing_best = _square_height(p, points, triangles, best, normal)
    margin = 1e-6 * (one + other) + _slack(max(one, other), p, largest)
    if abs(one - other) > margin:
        return one > other
    if abs(facing - facing_best) > SAME_FACING:
        return facing < facing_best
    return t < best


@njit(cache=True, parallel=True)
def _nearest(queries, normals, within, points, triangles, order, bounds, boxes, found, squares):
    largest = np.abs(boxes[0]).max()  # coordinate [m]
    for q in prange(len(queries)):
        p, normal = row(queries, q), row(normals, q)
        stack = np.empty(_DEPTH, dtype=np.int64)
        stack[0] = 0
        depth = 1
        best, least = -1, within * within
        slack = _slack(least, p, largest) if np.isfinite(least) else 0.0
        while depth > 0:
            depth -= 1
            node = stack[depth]
            if bounds[node, 0] == bounds[node, 1] or _square_to_box(p, boxes, node) > least + slack:
                continue
            left = 2 * node + 1
            if left < len(boxes):
                near, far = left, left + 1
                if _square_to_box(p, boxes, far) < _square_to_box(p, boxes, near):
                    near, far = far, near
                stack[depth] = far
                stack[depth + 1] = near
                depth += 2
                continue
            for k in range(bounds[node, 0], bounds[node, 1]):
                t = order[k]
                square = _square_to_triangle(p, points, triangles, t)
                tie = square <= least + slack
                if square < least - slack or (tie and _comes_first(p, normal, points, triangles, t, best, largest)):
                    best, least = t, min(square, least)
                    slack = _slack(least, p, largest)
        if best >= 0:
            found[q] = best
            squares[q] = _square_to_triangle(p, points, triangles, best)


@njit(cache=True, parallel=True)
def _all_within(queries, within, points, triangles, order, bounds, boxes, counts, starts, found, squares):
    """With an empty `found`, only count."""
    largest = np.abs(boxes[0]).max()  # coordinate [m]
    for q in prange(len(queries)):
        p = row(queries, q)
        limit = within * within + _slack(within * within, p, largest)
        stack = np.empty(_DEPTH, dtype=np.int64)
        stack[0] = 0
        depth, count = 1, 0
        while depth > 0:
            depth -= 1
            node = stack[depth]
            if bounds[node, 0] == bounds[node, 1] or _square_to_box(p, boxes, node) > limit:
                continue
            left = 2 * node + 1
            if left < len(boxes):
                stack[depth] = left
                stack[depth + 1] = left + 1
                depth += 2
                continue
            for k in range(bounds[node, 0], bounds[node, 1]):
                square = _square_to_triangle(p, points, triangles, order[k])
                if square <= limit:
                    if len(found):
                        found[starts[q] + count] = order[k]
                        squares[starts[q] + count] = square
                    count += 1
        counts[q] = count
