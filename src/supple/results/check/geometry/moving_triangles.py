"""Whether two triangles whose corners move on straight paths penetrate each other.

A corner and a triangle, or two sides, meet where four points are in one plane, at a root of a cubic polynomial of time,
and the place is in the triangle, or on both sides. These are signs of polynomials: in the basis of Bernstein, a
polynomial whose coefficients have one sign has it everywhere on the interval. Intervals are halved until the signs of
all polynomials are known beyond round-off. What is left then, a path through a side or a corner, counts as passing
where the four points turn over and touch to within 1e-8 of the coordinates.

Source: Farin, "Curves and Surfaces for CAGD" (Bernstein polynomials); the tests are those of Provot (1997).
"""

import numpy as np

from supple.results.check.geometry.triangle_distance import cross, dot, minus, point_triangle, segment_segment
from supple.results.check.geometry.triangle_pairs import triangles_meet
from supple.runtime.kernel_cache import njit

_DEPTH, _MOST_STEPS = 30, 400
_EPSILON, _NEAR = 2.0**-52, 1e-8


@njit(forceinline=False)
def _row(x, a):
    return (x[a, 0], x[a, 1], x[a, 2])


@njit(forceinline=False)
def _mixed(u, v, t):
    s = 1.0 - t
    return (s * u[0] + t * v[0], s * u[1] + t * v[1], s * u[2] + t * v[2])


@njit(forceinline=False)
def _between(x0, x1, a, b, t):
    """x_b - x_a at time t."""
    return _mixed(minus(_row(x0, b), _row(x0, a)), minus(_row(x1, b), _row(x1, a)), t)


@njit(forceinline=False)
def _normal(u0, v0, u1, v1):
    """Coefficients of u x v for u, v that are linear in time."""
    return cross(u0, v0), _mixed(cross(u0, v1), cross(u1, v0), 0.5), cross(u1, v1)


@njit(forceinline=False)
def _range(m, n):
    """Smallest and largest coefficient of m . n, both of second degree."""
    a = dot(m[0], n[0])
    b = 0.5 * (dot(m[0], n[1]) + dot(m[1], n[0]))
    c = (dot(m[0], n[2]) + 4.0 * dot(m[1], n[1]) + dot(m[2], n[0])) / 6.0
    d = 0.5 * (dot(m[1], n[2]) + dot(m[2], n[1]))
    e = dot(m[2], n[2])
    return min(a, b, c, d, e), max(a, b, c, d, e)


@njit(forceinline=False)
def _size(u, v):
    return max(abs(u[0]), abs(u[1]), abs(u[2]), abs(v[0]), abs(v[1]), abs(v[2]))


@njit(forceinline=False)
def _less(m, n):
    return minus(m[0], n[0]), minus(m[1], n[1]), minus(m[2], n[2])


@njit(forceinline=False)
def _state(x0, x1, four, sides, begin, end, largest):
    """Of one interval: 0 where nothing passes, 1 where something does, 2 where that is not known, 3 where it is not
    known and the four points turn over.

    four : the corner and the triangle's corners, or the ends of two sides; sides : which of the two
    """
    a, b, c, d = four
    # u and v along the sides, w between them; or u and v along the triangle b, c, d, w from it to the corner a.
    p, q, r, s, other = (a, b, c, d, c) if sides else (b, c, b, d, a)
    u0, u1 = _between(x0, x1, p, q, begin), _between(x0, x1, p, q, end)
    v0, v1 = _between(x0, x1, r, s, begin), _between(x0, x1, r, s, end)
    w0, w1 = _between(x0, x1, p, other, begin), _between(x0, x1, p, other, end)
    n = _normal(u0, v0, u1, v1)
    size = max(_size(u0, u1), _size(v0, v1), _size(w0, w1))
    error = 32.0 * _EPSILON * size * size * (size + largest)
    first, last = dot(n[0], w0), dot(n[2], w1)
    second = (2.0 * dot(n[1], w0) + dot(n[0], w1)) / 3.0
    third = (dot(n[2], w0) + 2.0 * dot(n[1], w1)) / 3.0
    lowest, highest = min(first, second, third, last), max(first, second, third, last)
    if lowest > error or highest < -error or (lowest >= -error and highest <= error):  # or in one plane all the time
        return 0
    # Shares along u and v of the place, times |n|^2, and what is left of each, or of both.
    along_u = _normal(w0, v0, w1, v1)
    along_v = _normal(w0, u0, w1, u1) if sides else _normal(u0, w0, u1, w1)
    rest_u = _less(n, along_u)
    rest_v = _less(n, along_v) if sides else _less(rest_u, along_v)
    error_4 = 64.0 * _EPSILON * size * size * size * (size + largest)
    inside = True
    for share in (along_u, along_v, rest_u if sides else rest_v, rest_v):
        low, high = _range(share, n)
        if high < -error_4:
            return 0
        inside = inside and low > error_4
    over = (first > error and last < -error) or (first < -error and last > error)
    if over and inside:
        return 1
    return 3 if over else 2


@njit(forceinline=False)
def _apart(x0, x1, four, sides, t):
    """Squared distance of the corner and the triangle, or of the two sides, at time t."""
    a, b = _mixed(_row(x0, four[0]), _row(x1, four[0]), t), _mixed(_row(x0, four[1]), _row(x1, four[1]), t)
    c, d = _mixed(_row(x0, four[2]), _row(x1, four[2]), t), _mixed(_row(x0, four[3]), _row(x1, four[3]), t)
    return segment_segment(a, b, c, d) if sides else point_triangle(a, b, c, d)


@njit(forceinline=False)
def points_pass(x0, x1, four, sides):
    """Whether a corner (the first of four rows) passes through a triangle, or a side (two rows) through another."""
    largest = 0.0
    for row in four:
        for k in range(3):
            largest = max(largest, abs(x0[row, k]), abs(x1[row, k]))
    state = _state(x0, x1, four, sides, 0.0, 1.0, largest)
    if state < 2:
        return state == 1
    begin, depth = np.zeros(2 * _DEPTH + 4), np.zeros(2 * _DEPTH + 4, dtype=np.int64)
    top, steps = 1, 0
    while top > 0 and steps < _MOST_STEPS:
        steps += 1
        top -= 1
        t, level = begin[top], depth[top]
        width = 0.5**level
        state = _state(x0, x1, four, sides, t, t + width, largest)
        if state == 1:
            return True
        if state == 0:
            continue
        if level == _DEPTH:
            # Sides that are parallel for a moment turn over as well, wherever they are.
            if state == 3 and _apart(x0, x1, four, sides, t) <= _NEAR * _NEAR * largest * largest:
                return True
            continue
        begin[top], depth[top] = t + 0.5 * width, level + 1
        begin[top + 1], depth[top + 1] = t, level + 1
        top += 2
    return False


@njit(forceinline=False)
def _is_in(row, t):
    return row == t[0] or row == t[1] or row == t[2]


@njit(forceinline=False)
def _corners_or_sides_pass(x0, x1, s, t):
    for i in range(3):
        if not _is_in(s[i], t) and points_pass(x0, x1, (s[i], t[0], t[1], t[2]), False):
            return True
        if not _is_in(t[i], s) and points_pass(x0, x1, (t[i], s[0], s[1], s[2]), False):
            return True
        a, b = s[i], s[(i + 1) % 3]
        if _is_in(a, t) or _is_in(b, t):
            continue
        for j in range(3):
            c, d = t[j], t[(j + 1) % 3]
            if not _is_in(c, s) and not _is_in(d, s) and points_pass(x0, x1, (a, b, c, d), True):
                return True
    return False


@njit(forceinline=False)
def triangles_pass(x0, x1, s, t):
    """Whether two triangles, three rows each, penetrate each other between x0 and x1, where they do not meet."""
    if not _corners_or_sides_pass(x0, x1, s, t):
        return False
    return not triangles_meet(x0, s, t) and not triangles_meet(x1, s, t)
