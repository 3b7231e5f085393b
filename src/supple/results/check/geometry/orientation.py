"""On which side: signs of determinants of points, exact for every finite input.

First in floating point, with a bound of the rounding error; where the sign is in doubt, without rounding. Points are
rows of an array x (n, 3).

Source: Shewchuk (1997), section 4: the filters' bounds are those of ORIENT3D and ORIENT2D, stage A.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numba import objmode

from supple.results.check.geometry.exact_sums import add_product2, add_product3, in_range, sign_of, two_sum
from supple.runtime.kernel_cache import njit

_EPSILON = 2.0**-53
_BOUND_3 = (7.0 + 56.0 * _EPSILON) * _EPSILON
_BOUND_2 = (3.0 + 16.0 * _EPSILON) * _EPSILON
# dot((x - p), n): three products of a difference, three roundings each, two sums; with room to spare.
_BOUND_DOT = 8.0 * _EPSILON
# The bounds hold where nothing underflows; what is smaller than this is decided without rounding.
_TINY = 1e-200


@njit(cache=True, nogil=False)
def volume_sign(x, a, b, c, d):
    """Sign of det[x_b - x_a, x_c - x_a, x_d - x_a]: 1 for a positive tetrahedron, 0 for four points in a plane."""
    bx, by, bz = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
    cx, cy, cz = x[c, 0] - x[a, 0], x[c, 1] - x[a, 1], x[c, 2] - x[a, 2]
    dx, dy, dz = x[d, 0] - x[a, 0], x[d, 1] - x[a, 1], x[d, 2] - x[a, 2]
    cd, dc = cx * dy, dx * cy
    db, bd = dx * by, bx * dy
    bc, cb = bx * cy, cx * by
    det = bz * (cd - dc) + cz * (db - bd) + dz * (bc - cb)
    size = (
        (abs(cd) + abs(dc)) * abs(bz) + (abs(db) + abs(bd)) * abs(cz) + (abs(bc) + abs(cb)) * abs(dz)
    ) * _BOUND_3 + _TINY
    if det > size:
        return 1
    if -det > size:
        return -1
    if (bx == 0.0 and cx == 0.0 and dx == 0.0) or (by == 0.0 and cy == 0.0 and dy == 0.0):
        return 0
    if bz == 0.0 and cz == 0.0 and dz == 0.0:
        return 0
    return _exact_volume_sign(x, a, b, c, d)


@njit(nogil=False, forceinline=False)
def _exact_volume_sign(x, a, b, c, d):
    for k in range(3):
        if not (in_range(x[a, k]) and in_range(x[b, k]) and in_range(x[c, k]) and in_range(x[d, k])):
            with objmode(sign="int64"):
                sign = rational_volume_sign(x[a], x[b], x[c], x[d])
            return sign
    bx, by, bz = two_sum(x[b, 0], -x[a, 0]), two_sum(x[b, 1], -x[a, 1]), two_sum(x[b, 2], -x[a, 2])
    cx, cy, cz = two_sum(x[c, 0], -x[a, 0]), two_sum(x[c, 1], -x[a, 1]), two_sum(x[c, 2], -x[a, 2])
    dx, dy, dz = two_sum(x[d, 0], -x[a, 0]), two_sum(x[d, 1], -x[a, 1]), two_sum(x[d, 2], -x[a, 2])
    h = np.empty(200)
    n = add_product3(h, 0, 1.0, cx, dy, bz)
    n = add_product3(h, n, -1.0, dx, cy, bz)
    n = add_product3(h, n, 1.0, dx, by, cz)
    n = add_product3(h, n, -1.0, bx, dy, cz)
    n = add_product3(h, n, 1.0, bx, cy, dz)
    n = add_product3(h, n, -1.0, cx, by, dz)
    return sign_of(h, n)


@njit(cache=True, nogil=False)
def area_sign(x, a, b, c, i, j):
    """Sign of the area of the triangle a, b, c as seen on the plane of the coordinates i and j."""
    bi, bj, ci, cj = x[b, i] - x[a, i], x[b, j] - x[a, j], x[c, i] - x[a, i], x[c, j] - x[a, j]
    left, right = bi * cj, bj * ci
    det = left - right
    size = (abs(left) + abs(right)) * _BOUND_2 + _TINY
    if det > size:
        return 1
    if -det > size:
        return -1
    for k in (i, j):
        if not (in_range(x[a, k]) and in_range(x[b, k]) and in_range(x[c, k])):
            with objmode(sign="int64"):
                sign = rational_area_sign(x[a], x[b], x[c], i, j)
            return sign
    h = np.empty(20)
    n = add_product2(h, 0, 1.0, two_sum(x[b, i], -x[a, i]), two_sum(x[c, j], -x[a, j]))
    n = add_product2(h, n, -1.0, two_sum(x[b, j], -x[a, j]), two_sum(x[c, i], -x[a, i]))
    return sign_of(h, n)


@njit(nogil=False, forceinline=False)
def plane_side(x, a, point, normal):
    """Sign of (x_a - point) . normal: 1 on the side that the normal points to."""
    dot = size = 0.0
    for k in range(3):
        term = (x[a, k] - point[k]) * normal[k]
        dot += term
        size += abs(term)
    size = size * _BOUND_DOT + _TINY
    if dot > size:
        return 1
    if -dot > size:
        return -1
    for k in range(3):
        if not (in_range(x[a, k]) and in_range(point[k]) and in_range(normal[k])):
            with objmode(sign="int64"):
                sign = rational_plane_side(x[a], point, normal)
            return sign
    h = np.empty(20)
    n = 0
    for k in range(3):
        n = add_product2(h, n, 1.0, two_sum(x[a, k], -point[k]), (normal[k], 0.0))
    return sign_of(h, n)


@njit(cache=True, nogil=False)
def volume_signs(x, tets):
    """(m,) `volume_sign` of every tet (m, 4)."""
    out = np.empty(len(tets), dtype=np.int8)
    for e in range(len(tets)):
        out[e] = volume_sign(x, tets[e, 0], tets[e, 1], tets[e, 2], tets[e, 3])
    return out


@njit(cache=True, nogil=False)
def plane_sides(x, rows, point, normal):
    """(k,) `plane_side` of the points in `rows`."""
    out = np.empty(len(rows), dtype=np.int8)
    for k in range(len(rows)):
        out[k] = plane_side(x, rows[k], point, normal)
    return out


def _differences(a: np.ndarray, b: np.ndarray) -> list[Fraction]:
    return [Fraction(float(p)) - Fraction(float(q)) for p, q in zip(a, b, strict=True)]


def _sign(value: Fraction) -> int:
    return (value > 0) - (value < 0)


def rational_volume_sign(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> int:
    """`volume_sign` of four points (3,) in rational arithmetic: slow, and without a range."""
    u, v, w = _differences(b, a), _differences(c, a), _differences(d, a)
    cross = (v[1] * w[2] - v[2] * w[1], v[2] * w[0] - v[0] * w[2], v[0] * w[1] - v[1] * w[0])
    return _sign(u[0] * cross[0] + u[1] * cross[1] + u[2] * cross[2])


def rational_area_sign(a: np.ndarray, b: np.ndarray, c: np.ndarray, i: int, j: int) -> int:
    """`area_sign` of three points (3,) in rational arithmetic."""
    u, v = _differences(b, a), _differences(c, a)
    return _sign(u[i] * v[j] - u[j] * v[i])


def rational_plane_side(x: np.ndarray, point: np.ndarray, normal: np.ndarray) -> int:
    """`plane_side` of a point (3,) in rational arithmetic."""
    terms = (d * Fraction(float(n)) for d, n in zip(_differences(x, point), normal, strict=True))
    return _sign(sum(terms, Fraction(0)))
