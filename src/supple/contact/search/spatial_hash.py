"""Points in a hashed grid, and the triangles that are near them.

A triangle visits the cells that its box overlaps, enlarged by the common search radius, which suffices for most points.
A point is entered in its own cell. Where its search radius is larger than the common one, it is entered in all cells
that the remainder of its box overlaps, so that one point with a large radius does not slow down the others. A pair is
tested in one cell only: the first that both boxes overlap. The grid is filled by a counting sort, so the order of all
results depends on the input alone.

Source: Teschner et al., "Optimized Spatial Hashing for Collision Detection of Deformable Objects" (2003).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from supple.numerics.geometry.closest_point import closest_on_triangle, combine
from supple.numerics.kernel_cache import njit
from supple.numerics.mat3 import dot, row, subtract

# Largest number of cells along the longest side; cells grow where there would be more. Three numbers fit into 63 bits.
MOST_CELLS = 1 << 20
# A point whose box overlaps more cells than this is not entered in the grid and is tested against every triangle.
WIDE = 1000
# Percentile of the search radii that is the common one, by which triangles are enlarged.
COMMON_PERCENTILE = 90.0


@njit
def _key(i, j, k):
    return (np.int64(i) << 42) | (np.int64(j) << 21) | np.int64(k)


@njit
def _bucket(i, j, k, mask):
    return ((i * 73856093) ^ (j * 19349663) ^ (k * 83492791)) & mask


@njit
def _cell(coordinate, low, size):
    """Number of a cell along one axis, 0 .. MOST_CELLS."""
    return math.floor(max(0.0, min((coordinate - low) / size, float(MOST_CELLS))))


@njit(cache=True)
def boxes_of_pieces(points, point_piece, pad, low, high):
    """Bounds low, high (p, 3) of each piece's points, each point enlarged by its first entry in pad (n, 3)."""
    low[:] = np.inf
    high[:] = -np.inf
    for i in range(len(points)):
        k = point_piece[i]
        for j in range(3):
            low[k, j] = min(low[k, j], points[i, j] - pad[i, 0])
            high[k, j] = max(high[k, j], points[i, j] + pad[i, 0])


@njit
def _overlaps_another(low, high, piece, partners, boxes):
    """Whether a box of one piece overlaps that of another piece that it may touch."""
    piece_low, piece_high = boxes
    for k in range(len(piece_low)):
        if (
            k != piece
            and partners[piece, k]
            and low[0] <= piece_high[k, 0]
            and high[0] >= piece_low[k, 0]
            and low[1] <= piece_high[k, 1]
            and high[1] >= piece_low[k, 1]
            and low[2] <= piece_high[k, 2]
            and high[2] >= piece_low[k, 2]
        ):
            return True
    return False


@njit(cache=True)
def hash_points(shapes, radii, rules, boxes, lattice, around, first, last, starts):
    """Find the cells of points.

    Writes the box around each point into around (n, 6), the range of its cells into first, last (n, 3), and the number
    of entries before each bucket into starts.

    Parameters
    ----------
    shapes, radii, rules, boxes : see `find_pairs`
    lattice : edge of a cell [m]; common search radius [m]; origin of the grid (3,) [m]
    starts : (buckets + 1,) with a power of two of buckets

    Returns
    -------
    The number of entries.
    """
    points, point_piece, _, _ = shapes
    far, near = radii
    size, common, low = lattice
    mask = len(starts) - 2
    starts[:] = 0
    box_low, box_high = np.zeros(3), np.zeros(3)
    for p in range(len(points)):
        for j in range(3):
            box_low[j], box_high[j] = points[p, j] - far[p, 0], points[p, j] + far[p, 0]
        r = near[p, 0]
        if _overlaps_another(box_low, box_high, point_piece[p], rules[0], boxes):
            r = max(r, far[p, 0])
        count = 1.0
        for j in range(3):
            around[p, j], around[p, 3 + j] = points[p, j] - r, points[p, j] + r
            first[p, j] = _cell(points[p, j] - max(0.0, r - common), low[j], size)
            last[p, j] = _cell(points[p, j] + max(0.0, r - common), low[j], size)
            count *= last[p, j] - first[p, j] + 1.0
        if count > WIDE:
            last[p, 0] = -1
            continue
        for i in range(first[p, 0], last[p, 0] + 1):
            for j in range(first[p, 1], last[p, 1] + 1):
                for k in range(first[p, 2], last[p, 2] + 1):
                    starts[_bucket(i, j, k, mask) + 1] += 1
    for b in range(1, len(starts)):
        starts[b] += starts[b - 1]
    return starts[len(starts) - 1]


@njit(cache=True)
def fill_buckets(first, last, starts, entries, keys):
    """Write the points and cell keys of all entries, bucket by bucket, in the order of points."""
    mask = len(starts) - 2
    fill = starts[:-1].copy()
    for p in range(len(first)):
        for i in range(first[p, 0], last[p, 0] + 1):
            for j in range(first[p, 1], last[p, 1] + 1):
                for k in range(first[p, 2], last[p, 2] + 1):
                    b = _bucket(i, j, k, mask)
                    entries[fill[b]] = p
                    keys[fill[b]] = _key(i, j, k)
                    fill[b] += 1


@njit
def is_excluded(point, triangle, excluded_starts, excluded_points):
    """Whether the point is in the triangle's list of excluded points."""
    for e in range(excluded_starts[triangle], excluded_starts[triangle + 1]):  # noqa: SIM110
        if excluded_points[e] == point:
            return True
    return False


@njit
def _overlaps(around, p, low, high):
    """Whether the box around point p overlaps another."""
    return (
        around[p, 0] <= high[0]
        and around[p, 3] >= low[0]
        and around[p, 1] <= high[1]
        and around[p, 4] >= low[1]
        and around[p, 2] <= high[2]
        and around[p, 5] >= low[2]
    )


@njit(cache=True)
def find_pairs(shapes, radii, rules, boxes, grid, wide, out):
    """Find pairs (point, triangle) that may touch, triangle by triangle. Writes as many as fit; returns their number.

    Parameters
    ----------
    shapes : points (n, 3), point_piece (n,), triangles (t, 3), triangle_piece (t,)
    radii : two (n, 2) arrays, for pairs of different pieces and for pairs of one piece: the search radius of a point
        (with its own motion), and how far its motion may move a corner of a triangle [m]
    rules : partners (p, p), whether two pieces may touch either way; allowed (p, p), whether points of the first may
        touch triangles of the second; and the excluded points of each triangle as starts (t + 1,) and points
    boxes : low, high (p, 3), from `boxes_of_pieces`, enlarged by the search radii
    grid : size, common, low, around, first, starts, entries, keys, from `hash_points` and `fill_buckets`
    wide : points that are not in the grid
    out : two int32 arrays for points and triangles
    """
    points, point_piece, triangles, triangle_piece = shapes
    far, near = radii
    partners, allowed, excluded_starts, excluded_points = rules
    out_points, out_triangles = out
    found = np.zeros(len(points), dtype=np.int32)
    size, common, origin, around, first, starts, entries, keys = grid
    mask = len(starts) - 2
    count = 0
    low, high = np.zeros(3), np.zeros(3)
    begin, end = np.zeros(3, dtype=np.int64), np.zeros(3, dtype=np.int64)
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        its = triangle_piece[t]
        moves_far, moves_near = max(far[a, 1], far[b, 1], far[c, 1]), max(near[a, 1], near[b, 1], near[c, 1])
        for j in range(3):
            low[j] = min(points[a, j], points[b, j], points[c, j]) - moves_far
            high[j] = max(points[a, j], points[b, j], points[c, j]) + moves_far
        if _overlaps_another(low, high, its, partners, boxes):
            more = max(0.0, moves_near - moves_far)
        elif allowed[its, its]:
            more = moves_near - moves_far
        else:
            continue
        volume = 1.0
        for j in range(3):
            low[j] -= more
            high[j] += more
            begin[j] = _cell(low[j] - common, origin[j], size)
            end[j] = _cell(high[j] + common, origin[j], size)
            volume *= end[j] - begin[j] + 1.0
        close = 0  # points whose box overlaps the triangle's
        if volume > len(points):
            for p in range(len(points)):
                if _overlaps(around, p, low, high):
                    found[close] = p
                    close += 1
        else:
            for p in wide:
                if _overlaps(around, p, low, high):
                    found[close] = p
                    close += 1
            for i in range(begin[0], end[0] + 1):
                for j in range(begin[1], end[1] + 1):
                    for k in range(begin[2], end[2] + 1):
                        s, key = _bucket(i, j, k, mask), _key(i, j, k)
                        for e in range(starts[s], starts[s + 1]):
                            p = entries[e]
                            if (
                                keys[e] == key
                                and _overlaps(around, p, low, high)
                                and max(first[p, 0], begin[0]) == i
                                and max(first[p, 1], begin[1]) == j
                                and max(first[p, 2], begin[2]) == k
                            ):
                                found[close] = p
                                close += 1
        u, v, w = row(points, a), row(points, b), row(points, c)
        for f in range(close):
            p = found[f]
            mine = point_piece[p]
            if p in (a, b, c) or not allowed[mine, its]:
                continue
            r = near[p, 0] + moves_near if mine == its else far[p, 0] + moves_far
            x = row(points, p)
            d = subtract(x, combine(closest_on_triangle(x, u, v, w), u, v, w))
            if dot(d, d) > r * r or is_excluded(p, t, excluded_starts, excluded_points):
                continue
            if count < len(out_points):
                out_points[count] = p
                out_triangles[count] = t
            count += 1
    return count


@njit(cache=True)
def group_by_point(pair_points, pair_triangles, count, starts, active, triangles):
    """Sort pairs by point, then triangle: starts (n + 1,), active points, triangles. Returns how many are active."""
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
    """Lists of triangles near each point. Every search reuses the same memory.

    After `gather`, the triangles near point p are `triangles[starts[p]:starts[p + 1]]` in ascending order, and
    `active[:n_active]` are the points that have any.
    """

    def __init__(self, n_points: int, n_pieces: int, edge_length: float) -> None:
        self.edge_length = edge_length
        self._around = np.zeros((n_points, 6))
        self._first = np.zeros((n_points, 3), dtype=np.int32)
        self._last = np.zeros((n_points, 3), dtype=np.int32)
        self._buckets = np.zeros((1 << max(4, (2 * n_points).bit_length())) + 1, dtype=np.int64)
        self._entries = np.zeros(8 * n_points, dtype=np.int32)
        self._keys = np.zeros(8 * n_points, dtype=np.int64)
        self._low, self._high = np.zeros((n_pieces, 3)), np.zeros((n_pieces, 3))
        self._pairs = (np.zeros(4096, dtype=np.int32), np.zeros(4096, dtype=np.int32))
        self.starts = np.zeros(n_points + 1, dtype=np.int64)
        self.active = np.zeros(n_points, dtype=np.int32)
        self.triangles = np.zeros(4096, dtype=np.int32)
        self.n_active = 0
        self.count = 0

    def gather(self, shapes: tuple, radii: tuple, rules: tuple) -> None:
        """Find all pairs; for the arguments see `find_pairs` (`rules` without partners)."""
        points: NDArray[np.float64] = shapes[0]
        if not np.isfinite(points).all():
            self.n_active = self.count = 0
            return
        low = points.min(axis=0)
        common = float(np.percentile(radii[0][:, 0], COMMON_PERCENTILE))
        size = max(0.8 * (self.edge_length + 2.0 * common), 2.0 * float((points.max(axis=0) - low).max()) / MOST_CELLS)
        boxes, rules = (self._low, self._high), (rules[0] | rules[0].T, *rules)
        boxes_of_pieces(points, shapes[1], radii[0], *boxes)
        cells = (self._around, self._first, self._last, self._buckets)
        entries = hash_points(shapes, radii, rules, boxes, (size, common, low), *cells)
        if entries > len(self._entries):
            self._entries, self._keys = np.zeros(2 * entries, dtype=np.int32), np.zeros(2 * entries, dtype=np.int64)
        fill_buckets(self._first, self._last, self._buckets, self._entries, self._keys)
        wide = np.flatnonzero(self._last[:, 0] < 0)
        grid = (size, common, low, self._around, self._first, self._buckets, self._entries, self._keys)
        while True:
            count = find_pairs(shapes, radii, rules, boxes, grid, wide, self._pairs)
            if count <= len(self._pairs[0]):
                break
            self._pairs = (np.zeros(2 * count, dtype=np.int32), np.zeros(2 * count, dtype=np.int32))
        if len(self.triangles) < len(self._pairs[0]):
            self.triangles = np.zeros(len(self._pairs[0]), dtype=np.int32)
        self.n_active = group_by_point(*self._pairs, count, self.starts, self.active, self.triangles)
        self.count = count
