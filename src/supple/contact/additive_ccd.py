"""Continuous detection of collisions: how far two parts may move before they touch.

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

import math

from supple.numerics.geometry.closest_point import closest_on_triangle, combine
from supple.numerics.geometry.closest_segments import closest_on_segments
from supple.numerics.mat3 import cross, dot, row, subtract
from supple.runtime.kernel_cache import njit

# The share of its distance that a pair keeps; and where the search for the longest step ends.
KEEP = 0.1
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
    """When gap + t speed falls to `keep`: 0 where it is below or there is no gap, infinite where it does not fall."""
    if not gap > 0.0:
        return 0.0
    if speed >= 0.0:
        return math.inf
    return max(0.0, (gap - keep) / -speed)


@njit
def _bound(n, a, p, b, q, so_far, keep):
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
def _point_triangle_bound(n, a, b, c, p, q, r, keep):
    """How long all corners keep their distance along n from a point at the origin, and the least distance now."""
    zero = (0.0, 0.0, 0.0)
    least = _bound(n, a, p, zero, zero, (math.inf, math.inf), keep)
    least = _bound(n, b, q, zero, zero, least, keep)
    return _bound(n, c, r, zero, zero, least, keep)


@njit
def _edge_edge_bound(n, b, c, d, p, q, r, keep):
    """The same for both ends of the edge c d and both ends of the edge of the origin and b."""
    zero = (0.0, 0.0, 0.0)
    least = _bound(n, c, q, zero, zero, (math.inf, math.inf), keep)
    least = _bound(n, d, r, zero, zero, least, keep)
    least = _bound(n, c, q, b, p, least, keep)
    return _bound(n, d, r, b, p, least, keep)


@njit
def _normal(u, v, n):
    """The unit vector normal to u and v, on the side of n.

    Where parts are nearer than 1e-8 of their sizes, round-off turns the direction of their distance, but not this one.
    """
    m, _ = _direction(cross(u, v))
    return m if dot(m, n) >= 0.0 else (-m[0], -m[1], -m[2])


@njit
def point_triangle_time(x, way, v, corners, limit):
    """How long, up to `limit`, point v and the triangle of `corners` (3) may move along `way` (s, 3) from x (s, 3).

    Until then they keep at least `KEEP` of their distance. Larger than `limit` where they may move longer than that.
    """
    o, shift = row(x, v), row(way, v)
    a, b, c = (subtract(row(x, corners[0]), o), subtract(row(x, corners[1]), o), subtract(row(x, corners[2]), o))
    p, q, r = (
        subtract(row(way, corners[0]), shift),
        subtract(row(way, corners[1]), shift),
        subtract(row(way, corners[2]), shift),
    )
    zero = (0.0, 0.0, 0.0)
    size = max(_largest(o), _largest(a), _largest(b), _largest(c))
    error = ROUND_OFF * (size + max(_largest(shift), _largest(p), _largest(q), _largest(r)))
    time, keep = 0.0, -1.0
    a0, b0, c0 = a, b, c
    for _ in range(_MOST_STEPS):
        n, gap = _direction(combine(closest_on_triangle(zero, a, b, c), a, b, c))
        if keep < 0.0:
            keep = KEEP * gap + error
        elif gap <= _CLOSE_ENOUGH * keep:
            return time
        step, least = _point_triangle_bound(n, a, b, c, p, q, r, keep)
        if not least > _PRECISE * gap:
            m = _normal(subtract(b, a), subtract(c, a), n)
            other_step, other_least = _point_triangle_bound(m, a, b, c, p, q, r, keep)
            if other_least > least:
                step = other_step
        if time + step > limit:
            return math.inf
        if not step > 0.0:
            return time
        time += step
        a, b, c = _moved(a0, p, time), _moved(b0, q, time), _moved(c0, r, time)
    return time


@njit
def edge_edge_time(x, way, one, other, limit):
    """The same for edges with the ends `one` (2) and `other` (2); see `point_triangle_time`."""
    o, shift = row(x, one[0]), row(way, one[0])
    zero = (0.0, 0.0, 0.0)
    b, c, d = (subtract(row(x, one[1]), o), subtract(row(x, other[0]), o), subtract(row(x, other[1]), o))
    p, q, r = (
        subtract(row(way, one[1]), shift),
        subtract(row(way, other[0]), shift),
        subtract(row(way, other[1]), shift),
    )
    size = max(_largest(o), _largest(b), _largest(c), _largest(d))
    error = ROUND_OFF * (size + max(_largest(shift), _largest(p), _largest(q), _largest(r)))
    time, keep = 0.0, -1.0
    b0, c0, d0 = b, c, d
    for _ in range(_MOST_STEPS):
        s, t = closest_on_segments(zero, b, c, d)
        w = subtract(d, c)
        n, gap = _direction((c[0] + t * w[0] - s * b[0], c[1] + t * w[1] - s * b[1], c[2] + t * w[2] - s * b[2]))
        if keep < 0.0:
            keep = KEEP * gap + error
        elif gap <= _CLOSE_ENOUGH * keep:
            return time
        step, least = _edge_edge_bound(n, b, c, d, p, q, r, keep)
        if not least > _PRECISE * gap:
            other_step, other_least = _edge_edge_bound(_normal(b, w, n), b, c, d, p, q, r, keep)
            if other_least > least:
                step = other_step
        if time + step > limit:
            return math.inf
        if not step > 0.0:
            return time
        time += step
        b, c, d = _moved(b0, p, time), _moved(c0, q, time), _moved(d0, r, time)
    return time
