"""Points in a hashed grid, and the triangles that are near them.

The grid is built by a counting sort: the order of everything depends on the input alone.

Source: Teschner et al., "Optimized Spatial Hashing for Collision Detection of Deformable Objects" (2003).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from supple.numerics.mat3 import dot, row, subtract
from supple.xpbd.closest_point import closest_on_triangle, combine

# Cells along the longest side of everything: beyond this, cells grow. Keeps cell numbers far inside 32 bits.
MOST_CELLS = 1 << 20


@njit
def _bucket(i, j, k, mask):
    return ((i * 73856093) ^ (j * 19349663) ^ (k * 83492791)) & mask


@njit(cache=True)
def hash_points(points, size, low, cells, starts, entries):
    """Sort points (n, 3) into buckets. Writes cells (n, 3), starts (buckets + 1,) and entries (n,).

    size : edge of a cell [m]; low : (3,) the grid's origin; the number of buckets is a power of two.
    """
    mask = len(starts) - 2
    starts[:] = 0
    for p in range(len(points)):
        for j in range(3):
            cells[p, j] = int(math.floor((points[p, j] - low[j]) / size))
        starts[_bucket(cells[p, 0], cells[p, 1], cells[p, 2], mask) + 1] += 1
    for b in range(1, len(starts)):
        starts[b] += starts[b - 1]
    # Filled from the back, so that `starts` ends as the beginnings again.
    fill = starts[1:].copy()
    for p in range(len(points) - 1, -1, -1):
        b = _bucket(cells[p, 0], cells[p, 1], cells[p, 2], mask)
        fill[b] -= 1
        entries[fill[b]] = p


@njit
def is_excluded(point, triangle, excluded_starts, excluded_points):
    """Whether a pair is masked: the point belongs to the triangle or to its neighbourhood."""
    for e in range(excluded_starts[triangle], excluded_starts[triangle + 1]):
        if excluded_points[e] == point:
            return True
    return False


@njit(cache=True)
def boxes_of_pieces(points, point_piece, pad, low, high):
    """Bounds low, high (p, 3) of each piece's points, each widened by pad (n,)."""
    low[:] = np.inf
    high[:] = -np.inf
    for i in range(len(points)):
        k = point_piece[i]
        for j in range(3):
            low[k, j] = min(low[k, j], points[i, j] - pad[i])
            high[k, j] = max(high[k, j], points[i, j] + pad[i])


@njit
def _meets_a_piece(low, high, allowed, piece, piece_low, piece_high):
    """Whether a box overlaps that of some piece whose points may touch triangles of `piece`."""
    if allowed[piece, piece]:
        return True
    for k in range(len(piece_low)):
        if allowed[k, piece]:
            meets = True
            for j in range(3):
                meets = meets and low[j] <= piece_high[k, j] and high[j] >= piece_low[k, j]
            if meets:
                return True
    return False


@njit
def _test(p, t, shapes, radii, rules, out, count):
    """Append the pair (point p, triangle t) where it may touch. Returns the new count."""
    points, point_piece, triangles, triangle_piece = shapes
    far, near = radii
    allowed, excluded_starts, excluded_points = rules
    out_points, out_triangles = out
    mine, its = point_piece[p], triangle_piece[t]
    if not allowed[mine, its]:
        return count
    a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    if mine == its:
        r = near[p, 0] + max(near[a, 1], near[b, 1], near[c, 1])
    else:
        r = far[p, 0] + max(far[a, 1], far[b, 1], far[c, 1])
    for j in range(3):
        u, v, w, x = points[a, j], points[b, j], points[c, j], points[p, j]
        if x < min(u, v, w) - r or x > max(u, v, w) + r:
            return count
    if is_excluded(p, t, excluded_starts, excluded_points):
        return count
    x, u, v, w = row(points, p), row(points, a), row(points, b), row(points, c)
    d = subtract(x, combine(closest_on_triangle(x, u, v, w), u, v, w))
    if dot(d, d) > r * r:
        return count
    if count < len(out_points):
        out_points[count] = p
        out_triangles[count] = t
    return count + 1


@njit(cache=True)
def find_pairs(shapes, radii, rules, boxes, grid, out):
    """Pairs (point, triangle) that may touch, triangle by triangle. Returns how many there are; writes what fits.

    Parameters
    ----------
    shapes : points (n, 3), point_piece (n,), triangles (t, 3), triangle_piece (t,)
    radii : two (n, 2) arrays, for pairs of different pieces and of one piece: how far a point looks out for triangles
        (with its own motion), and how far its motion may carry a triangle's corner [m]
    rules : allowed (p, p), and the excluded points of each triangle as starts (t + 1,) and points
    boxes : low, high (p, 3), from `boxes_of_pieces`, widened by how far points look
    grid : size, low, cells, starts, entries, from `hash_points`
    out : two int32 arrays for points and triangles
    """
    points, _, triangles, triangle_piece = shapes
    far, near = radii
    allowed = rules[0]
    piece_low, piece_high = boxes
    size, origin, cells, starts, entries = grid
    mask = len(starts) - 2
    widest = 0.0
    top = np.zeros(3, dtype=np.int64)
    for p in range(len(points)):
        widest = max(widest, far[p, 0], near[p, 0])
        for j in range(3):
            top[j] = max(top[j], cells[p, j])
    count = 0
    low, high = np.zeros(3), np.zeros(3)
    first, last = np.zeros(3, dtype=np.int64), np.zeros(3, dtype=np.int64)
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        moves = max(far[a, 1], far[b, 1], far[c, 1], near[a, 1], near[b, 1], near[c, 1])
        for j in range(3):
            low[j] = min(points[a, j], points[b, j], points[c, j]) - moves
            high[j] = max(points[a, j], points[b, j], points[c, j]) + moves
        if not _meets_a_piece(low, high, allowed, triangle_piece[t], piece_low, piece_high):
            continue
        volume = 1.0
        for j in range(3):
            first[j] = int(math.floor(max(0.0, min((low[j] - widest - origin[j]) / size, float(top[j] + 1)))))
            last[j] = int(math.floor(max(-1.0, min((high[j] + widest - origin[j]) / size, float(top[j])))))
            volume *= max(0.0, float(last[j] - first[j] + 1))
        if volume > len(points):
            for p in range(len(points)):
                count = _test(p, t, shapes, radii, rules, out, count)
            continue
        for i in range(first[0], last[0] + 1):
            for j in range(first[1], last[1] + 1):
                for k in range(first[2], last[2] + 1):
                    s = _bucket(i, j, k, mask)
                    for e in range(starts[s], starts[s + 1]):
                        p = entries[e]
                        if cells[p, 0] == i and cells[p, 1] == j and cells[p, 2] == k:
                            count = _test(p, t, shapes, radii, rules, out, count)
    return count


@njit(cache=True)
def group_by_point(pair_points, pair_triangles, count, starts, active, triangles):
    """Order pairs by point, then triangle: starts (n + 1,), active points, triangles. Returns how many are active."""
    starts[:] = 0
    for e in range(count):
        starts[pair_points[e] + 1] += 1
    n_active = 0
    for p in range(len(starts) - 1):
        if starts[p + 1] > 0:
            active[n_active] = p
            n_active += 1
        starts[p + 1] += starts[p]
    fill = starts[:-1].copy()
    for e in range(count):
        p = pair_points[e]
        triangles[fill[p]] = pair_triangles[e]
        fill[p] += 1
    return n_active


class PairFinder:
    """Lists of triangles near each point, made again and again in the same memory.

    After `gather`, the triangles near point p are `triangles[starts[p]:starts[p + 1]]` in ascending order, and
    `active[:n_active]` are the points that have any.
    """

    def __init__(self, n_points: int, n_pieces: int, cell_size: float) -> None:
        self.cell_size = cell_size
        self._cells = np.zeros((n_points, 3), dtype=np.int64)
        self._buckets = np.zeros((1 << max(4, (2 * n_points).bit_length())) + 1, dtype=np.int64)
        self._entries = np.zeros(n_points, dtype=np.int32)
        self._low, self._high = np.zeros((n_pieces, 3)), np.zeros((n_pieces, 3))
        self._pairs = (np.zeros(4096, dtype=np.int32), np.zeros(4096, dtype=np.int32))
        self.starts = np.zeros(n_points + 1, dtype=np.int64)
        self.active = np.zeros(n_points, dtype=np.int32)
        self.triangles = np.zeros(4096, dtype=np.int32)
        self.n_active = 0
        self.count = 0

    def gather(self, shapes: tuple, radii: tuple, rules: tuple) -> None:
        """Find all pairs; for the arguments see `find_pairs`."""
        points: NDArray[np.float64] = shapes[0]
        if not np.isfinite(points).all():
            self.n_active = self.count = 0
            return
        low = points.min(axis=0)
        size = max(self.cell_size, float((points.max(axis=0) - low).max()) / MOST_CELLS)
        hash_points(points, size, low, self._cells, self._buckets, self._entries)
        boxes_of_pieces(points, shapes[1], np.ascontiguousarray(radii[0][:, 0]), self._low, self._high)
        grid = (size, low, self._cells, self._buckets, self._entries)
        while True:
            count = find_pairs(shapes, radii, rules, (self._low, self._high), grid, self._pairs)
            if count <= len(self._pairs[0]):
                break
            self._pairs = (np.zeros(2 * count, dtype=np.int32), np.zeros(2 * count, dtype=np.int32))
        if len(self.triangles) < len(self._pairs[0]):
            self.triangles = np.zeros(len(self._pairs[0]), dtype=np.int32)
        self.n_active = group_by_point(*self._pairs, count, self.starts, self.active, self.triangles)
        self.count = count
