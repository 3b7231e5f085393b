"""On which side: signs of determinants of points, exact for every finite input.

First in floating point, with a bound of the rounding error; where the sign is in doubt, without rounding. Points are
rows of an array x (n, 3).

Numbers without rounding are nonoverlapping expansions: sums of floats that do not overlap, smallest first, in an array
h[:n]; the sign is that of the last one. Exact as long as nothing under- or overflows, which `SMALLEST` and `LARGEST`
make sure of; beyond them, rational numbers decide.

Source: Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates" (1997): sections
2.2 to 2.5; section 4 for the filters' bounds, those of ORIENT3D and ORIENT2D, stage A.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numba import objmode

from supple.runtime.kernel_cache import njit

_EPSILON = 2.0**-53
_BOUND_3 = (7.0 + 56.0 * _EPSILON) * _EPSILON
_BOUND_2 = (3.0 + 16.0 * _EPSILON) * _EPSILON
# dot((x - p), n): three products of a difference, three roundings each, two sums, with a margin.
_BOUND_DOT = 8.0 * _EPSILON
# The bounds hold where nothing underflows; what is smaller than this is decided without rounding.
_TINY = 1e-200
_SPLITTER = 134217729.0  # 2^27 + 1
# Coordinates within these, or zero, have differences, and threefold products of them, that float64 can hold exactly:
# their last bits are above 2^-354, so those of the products above 2^-1062.
SMALLEST, LARGEST = 2.0**-300, 2.0**300
_PARTS = 32  # of a threefold product of differences


@njit(forceinline=False)
def _two_sum(a, b):
    """a + b as the rounded sum and its error (theorem 7)."""
    s = a + b
    bb = s - a
    return s, (a - (s - bb)) + (b - bb)


@njit(forceinline=False)
def _two_product(a, b):
    """a b as the rounded product and its error (theorem 18)."""
    p = a * b
    c = _SPLITTER * a
    ah = c - (c - a)
    al = a - ah
    c = _SPLITTER * b
    bh = c - (c - b)
    bl = b - bh
    return p, al * bl - (((p - ah * bh) - al * bh) - ah * bl)


@njit(forceinline=False)
def _grow(h, n, b):
    """Add b to the expansion h[:n] in place, without zeros; the new length (theorem 10)."""
    q = b
    k = 0
    for i in range(n):
        q, e = _two_sum(q, h[i])
        if e != 0.0:
            h[k] = e
            k += 1
    if q != 0.0:
        h[k] = q
        k += 1
    return k


@njit(nogil=False, forceinline=False)
def exact_sign(p, q):
    """-1, 0 or 1: the sign of the sum of the products of each row of p - q, for p, q (k, 3)."""
    for k in range(len(p)):
        for j in range(3):
            for a in (abs(p[k, j]), abs(q[k, j])):
                if a != 0.0 and not SMALLEST <= a <= LARGEST:
                    with objmode(sign="int64"):
                        sign = rational_sign(p, q)
                    return sign
    h, n = np.empty(_PARTS * len(p) + 1), 0
    for k in range(len(p)):
        first, second = _two_sum(p[k, 0], -q[k, 0]), _two_sum(p[k, 1], -q[k, 1])
        for a in first:
            for b in second:
                for c in _two_product(a, b):
                    for d in _two_sum(p[k, 2], -q[k, 2]):
                        if c != 0.0 and d != 0.0:
                            rounded, error = _two_product(c, d)
                            n = _grow(h, _grow(h, n, error), rounded)
    return 0 if n == 0 else 1 if h[n - 1] > 0.0 else -1


def rational_sign(p: np.ndarray, q: np.ndarray) -> int:
    """`exact_sign` in rational arithmetic: slow, and without a range."""
    total = Fraction(0)
    for row in zip(p.tolist(), q.tolist(), strict=True):
        a, b, c = (Fraction(high) - Fraction(low) for high, low in zip(*row, strict=True))
        total += a * b * c
    return (total > 0) - (total < 0)


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
    p, q, k = np.empty((6, 3)), np.empty((6, 3)), 0
    for i, j in ((c, d), (d, b), (b, c)):
        last = b + c + d - i - j
        p[k, 0], q[k, 0] = x[i, 0], x[a, 0]
        p[k, 1], q[k, 1] = x[j, 1], x[a, 1]
        p[k + 1, 0], q[k + 1, 0] = x[a, 0], x[j, 0]  # the other order of both has the other sign
        p[k + 1, 1], q[k + 1, 1] = x[i, 1], x[a, 1]
        p[k : k + 2, 2], q[k : k + 2, 2] = x[last, 2], x[a, 2]
        k += 2
    return exact_sign(p, q)


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
    p = np.array([[x[b, i], x[c, j], 1.0], [x[a, j], x[c, i], 1.0]])
    return exact_sign(p, np.array([[x[a, i], x[a, j], 0.0], [x[b, j], x[a, i], 0.0]]))


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
    p, q = np.ones((3, 3)), np.zeros((3, 3))
    p[:, 0], p[:, 1], q[:, 0] = x[a], normal, point
    return exact_sign(p, q)


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
