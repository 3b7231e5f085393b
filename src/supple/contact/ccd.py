"""Continuous detection of collisions: how far two parts, or all points of a surface, may move before anything touches.

The time is advanced by steps over which the two certainly keep a part of their distance. For a unit vector n and points
a_i of one part, b_j of the other, which move by p_i and q_j, the distance at time t is at least

    min_ij  n . (a_i - b_j) + t n . (p_i - q_j),

whatever n is. With the direction of the present distance as n this is the present distance at t = 0, and at least the
bound of additive detection, d - t (max |p_i| + max |q_j|), afterwards. It does not change where both move together, and
parts that slide along each other need few steps. A step ends where the bound reaches the distance that is to be kept.

Everything is computed from differences of coordinates to one of the points, and the distance that is kept contains the
largest round-off of the positions that the caller computes with the result.

Source: Li, Kaufman, Jiang, "Codimensional Incremental Potential Contact" (2021), section 5, for the additive scheme;
its bound of the motion is replaced by the one above.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.contact.candidates import CandidateFinder, Candidates
from supple.contact.features.pair_geometry import EDGE_EDGE, VERTEX_TRIANGLE, corners
from supple.contact.mesh.contact_mesh import ContactMesh
from supple.numerics.geometry.closest_points import closest_on_segments, closest_on_triangle, combine
from supple.numerics.mat3 import cross, dot, row, subtract
from supple.runtime.kernel_cache import njit, prange

# The share of its distance that a pair keeps; and where the search for the longest step ends.
KEEP = 0.1
_NEARLY_ALL = 0.99
_CLOSE_ENOUGH = 1.05
# Along the direction of the distance, no points of the two parts are nearer than the distance; the share allows for
# round-off.
_PRECISE = 0.99
# Steps for one pair. The result is conservative wherever they end.
_MOST_STEPS = 10_000
# Of coordinates and ways: round-off of a position that is computed from them.
ROUND_OFF = 4.0 * 2.0**-52


@njit
def _largest(p):
    return max(abs(p[0]), abs(p[1]), abs(p[2]))


@njit
def _moved(x, p, t):
    return (x[0] + t * p[0], x[1] + t * p[1], x[2] + t * p[2])


@njit
def _time_to(gap, speed, keep):
    """When gap + t speed falls below `keep`: 0 where it is there already, infinite where it does not fall."""
    if not (gap > 0.0 and gap >= keep):
        return 0.0
    return math.inf if speed >= 0.0 else (gap - keep) / -speed


@njit
def _nearer(n, a, p, b, q, so_far, keep):
    """The time and the gap so far, or those of a point a + t p and b + t q along n where they are smaller."""
    gap = dot(n, subtract(a, b))
    return min(so_far[0], _time_to(gap, dot(n, subtract(p, q)), keep)), min(so_far[1], gap)


@njit
def _direction(r):
    """The unit vector along r, and the length of r; scaled, so that squares stay in range."""
    size = _largest(r)
    if not size > 0.0:
        return (0.0, 0.0, 0.0), 0.0
    u = (r[0] / size, r[1] / size, r[2] / size)
    length = math.sqrt(dot(u, u))
    return (u[0] / length, u[1] / length, u[2] / length), size * length


@njit
def _bound(kind, n, a, b, c, p, q, r, keep):
    """How long the points of the second part keep their distance along n from the first's, and the least one now."""
    zero = (0.0, 0.0, 0.0)
    least = _nearer(n, b, q, zero, zero, (math.inf, math.inf), keep)
    least = _nearer(n, c, r, zero, zero, least, keep)
    if kind == EDGE_EDGE:
        least = _nearer(n, b, q, a, p, least, keep)
        return _nearer(n, c, r, a, p, least, keep)
    return _nearer(n, a, p, zero, zero, least, keep)


@njit
def _between(kind, a, b, c):
    """The vector from the closest point of the first part to that of the second."""
    zero = (0.0, 0.0, 0.0)
    if kind == VERTEX_TRIANGLE:
        return combine(closest_on_triangle(zero, a, b, c), a, b, c)
    s, t = closest_on_segments(zero, a, b, c)
    w = subtract(c, b)
    return (b[0] + t * w[0] - s * a[0], b[1] + t * w[1] - s * a[1], b[2] + t * w[2] - s * a[2])


@njit
def _normal(u, v, n):
    """The unit vector normal to u and v, on the side of n.

    Where parts are nearer than 1e-8 of their sizes, round-off turns the direction of their distance, but not this one.
    """
    m, _ = _direction(cross(u, v))
    return m if dot(m, n) >= 0.0 else (-m[0], -m[1], -m[2])


class Kept(NamedTuple):
    """What remains of the gap of two parts (distance less offsets): a tenth of it or `near`, whichever is less, and at
    least `floor`.

    Attributes
    ----------
    floor : [m], of gaps above it; those below stay nearly as they are
    near : [m] parts that come no nearer than this limit no motion, so that candidates that do not are not missed
    """

    floor: float = 0.0
    near: float = math.inf


NO_FLOOR = Kept()


@njit
def _remainder(gap, kept):
    return max(min(KEEP * gap, kept.near), min(_NEARLY_ALL * gap, kept.floor))


@njit
def collision_time(x, way, kind, points, limit, kept, offset):
    """How long, up to `limit`, the parts of the four `points` may move along `way` (s, 3) from x (s, 3).

    Until then they keep what `Kept` says. Larger than `limit` where they may move longer than that.

    Parameters
    ----------
    kind : VERTEX_TRIANGLE or EDGE_EDGE; offset : of both parts together [m]
    """
    o, shift = row(x, points[0]), row(way, points[0])
    a0, b0, c0 = subtract(row(x, points[1]), o), subtract(row(x, points[2]), o), subtract(row(x, points[3]), o)
    p, q = subtract(row(way, points[1]), shift), subtract(row(way, points[2]), shift)
    r = subtract(row(way, points[3]), shift)
    size = max(_largest(o), _largest(a0), _largest(b0), _largest(c0))
    error = ROUND_OFF * (size + max(_largest(shift), _largest(p), _largest(q), _largest(r)))
    time, keep = 0.0, -1.0
    a, b, c = a0, b0, c0
    for _ in range(_MOST_STEPS):
        n, gap = _direction(_between(kind, a, b, c))
        if keep < 0.0:
            keep = offset + (_remainder(gap - offset, kept) + error)
        elif gap - offset <= _CLOSE_ENOUGH * (keep - offset):
            return time
        # Nearer than that, which only round-off does, parts may still go apart.
        held = min(keep, (1.0 - ROUND_OFF) * gap)
        step, least = _bound(kind, n, a, b, c, p, q, r, held)
        if not (least > _PRECISE * gap and least >= held):
            m = _normal(a, subtract(c, b), n) if kind == EDGE_EDGE else _normal(subtract(b, a), subtract(c, a), n)
            other_step, other_least = _bound(kind, m, a, b, c, p, q, r, held)
            if other_least > least:
                step = other_step
        if time + step > limit:
            return math.inf
        if not step > 0.0:
            return time
        time += step
        a, b, c = _moved(a0, p, time), _moved(b0, q, time), _moved(c0, r, time)
    return time


# What a long way sweeps overlaps everything, and most of a long way is not taken: it is divided into pieces of this
# many mean edges, which are examined one after another.
_PIECE = 8.0
_MOST_PIECES = 128
# Pairs are divided into this many runs, whatever the number of threads.
_RUNS = 64
# Boxes that stay this share of a pair's distance apart need no closer look.
_CLEAR = 2.0 * KEEP


class Limit(NamedTuple):
    """A step, and the pair that allows no more.

    Attributes
    ----------
    step : in [0, 1]
    kind : VERTEX_TRIANGLE or EDGE_EDGE
    points : its four points; none where nothing limits the step
    """

    step: float
    kind: int = VERTEX_TRIANGLE
    points: tuple[int, ...] = ()


def largest_step(
    mesh: ContactMesh,
    points: NDArray[np.float64],
    way: NDArray[np.float64],
    candidates: Candidates,
    kept: Kept = NO_FLOOR,
) -> Limit:
    """How far along `way` (s, 3) from `points` (s, 3), at most 1, every candidate keeps what `Kept` says.

    The points may be moved by step * way in rounded numbers. The pair is the first of those with the least step.
    """
    limit = Limit(1.0)
    for kind, pairs in ((VERTEX_TRIANGLE, candidates.vertex_triangle), (EDGE_EDGE, candidates.edge_edge)):
        step, k = _first(points, way, kind, mesh.triangles, mesh.edges, pairs, limit.step, kept, mesh.offsets)
        if k >= 0:
            limit = Limit(step, kind, tuple(map(int, corners(kind, mesh.triangles, mesh.edges, *pairs[k]))))
    return limit


class Along:
    """How far points may go on ways that are shorter than those given, each on its own; one search serves them all.

    Parameters
    ----------
    points, way : (s, 3) [m]; floor : see `Kept`
    """

    def __init__(
        self, finder: CandidateFinder, points: NDArray[np.float64], way: NDArray[np.float64], floor: float = 0.0
    ) -> None:
        self._finder, self._points, self._kept = finder, points, Kept(floor, finder.dhat)
        self._finite, self._all = bool(np.isfinite(way).all()), None
        if self._finite:
            edges = finder.mesh.edge_lengths
            piece = _PIECE * float(edges.mean()) if len(edges) else np.inf
            # Relative to its owner, a point goes twice as far at most.
            longest = 2.0 * float(np.sqrt(np.einsum("ij,ij->i", way, way).max(initial=0.0)))
            if longest > piece:
                longest = finder.longest(points, way)
            self._count = max(1, int(np.ceil(min(longest / piece, _MOST_PIECES))))
            self._complete = longest <= self._count * piece
            # A complete way must give exactly 1: count * (1 / count) can be slightly less.
            self._share = 1.0 / self._count if self._complete else piece / longest
            if self._count == 1:
                self._all = finder.find(points, points + way)

    def largest_step(self, way: NDArray[np.float64]) -> Limit:
        """The largest step along a way (s, 3) that is nowhere longer; see `largest_step`."""
        if not self._finite:
            return Limit(0.0)
        share = self._share
        for k in range(self._count):
            begin, part = self._points, share * way
            if k:
                begin = begin + (k * share) * way
            near = self._finder.find(begin, begin + part) if self._all is None else self._all
            limit = largest_step(self._finder.mesh, begin, part, near, self._kept)
            if limit.points:
                return limit._replace(step=(k + limit.step) * share)
        return Limit(1.0 if self._complete else self._count * share)


@njit
def is_clear(x, way, kind, points, offset):
    """Whether the boxes of two parts, of four points, stay so far apart along one axis that the gap is kept."""
    a, b, c, d = points
    square = 0.0
    for m in range(3):
        square += (x[a, m] - x[c, m]) ** 2
    for m in range(3):
        a0, b0, c0, d0 = x[a, m], x[b, m], x[c, m], x[d, m]
        a1, b1, c1, d1 = a0 + way[a, m], b0 + way[b, m], c0 + way[c, m], d0 + way[d, m]
        if kind == VERTEX_TRIANGLE:
            low0, high0, low1, high1 = a0, a0, a1, a1
            low2, high2 = min(b0, c0, d0), max(b0, c0, d0)
            low3, high3 = min(b1, c1, d1), max(b1, c1, d1)
        else:
            low0, high0, low1, high1 = min(a0, b0), max(a0, b0), min(a1, b1), max(a1, b1)
            low2, high2, low3, high3 = min(c0, d0), max(c0, d0), min(c1, d1), max(c1, d1)
        gap = max(min(low0 - high2, low1 - high3), min(low2 - high0, low3 - high1)) - offset
        if gap > 0.0 and gap * gap > _CLEAR * _CLEAR * square:
            size = max(abs(low0), abs(low1), abs(low2), abs(low3), abs(high0), abs(high1), abs(high2), abs(high3))
            return gap > ROUND_OFF * size
    return False


@njit(cache=True, parallel=True)
def _first(x, way, kind, triangles, edges, pairs, limit, kept, offsets):
    """The least step below `limit` of pairs (k, 2) of a kind, and the first row with it; `limit` and -1 for none."""
    steps, rows = np.full(_RUNS, limit), np.full(_RUNS, -1, dtype=np.int64)
    floor, near = kept  # Numba takes no tuples into a parallel loop
    for r in prange(_RUNS):
        its_kept = Kept(floor, near)
        least, at = limit, np.int64(-1)
        for k in range(r, len(pairs), _RUNS):
            points = corners(kind, triangles, edges, pairs[k, 0], pairs[k, 1])
            offset = offsets[points[0]] + offsets[points[2]]
            if not is_clear(x, way, kind, points, offset):
                step = collision_time(x, way, kind, points, least, its_kept, offset)
                if step < least:
                    least, at = step, k
        steps[r], rows[r] = least, at
    least, at = limit, np.int64(-1)
    for r in range(_RUNS):
        if rows[r] >= 0 and (at < 0 or steps[r] < least or (steps[r] == least and rows[r] < at)):
            least, at = steps[r], rows[r]
    return least, at
