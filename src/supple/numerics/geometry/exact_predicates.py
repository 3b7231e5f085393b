"""The side of a plane or line on which a point lies, always exact: a rounded determinant, then the exact one if needed.

Source: Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates" (1997): the error
bound of the first stage, then the whole determinant as a sum of numbers that do not overlap. Products of three
coordinates must neither overflow nor underflow.
"""

import numpy as np

from supple.numerics.geometry.double_double import two_product, two_sum
from supple.runtime.kernel_cache import njit

# (7 + 56 u) u with u = 2^-53: bound of the rounding error, relative to the sum of the products' magnitudes.
_ERROR = (7.0 + 56.0 * 2.0**-53) * 2.0**-53
# 6 permutations x 8 choices of a difference's two parts x 4 parts of a product of three.
_PARTS = 192


@njit(forceinline=False)
def _add(parts, n, value):
    """Add a number to a sum of n numbers that do not overlap, exactly; returns the new n."""
    kept = 0
    for i in range(n):
        value, low = two_sum(value, parts[i])
        if low != 0.0:
            parts[kept] = low
            kept += 1
    if value != 0.0:
        parts[kept] = value
        kept += 1
    return kept


@njit(forceinline=False)
def _exact_sign(a, b, c, d):
    """Sign of det[b - a, c - a, d - a]."""
    high, low = np.empty((3, 3)), np.empty((3, 3))
    for j in range(3):
        for i, p in enumerate((b, c, d)):
            high[i, j], low[i, j] = two_sum(p[j], -a[j])
    parts = np.empty(_PARTS)
    n = 0
    for k in range(3):
        for turn in (1, 2):
            sign = 1.0 if turn == 1 else -1.0
            first, second, third = k, (k + turn) % 3, (k + 2 * turn) % 3
            for u in (high[0, first], low[0, first]):
                for v in (high[1, second], low[1, second]):
                    p, q = two_product(sign * u, v)
                    for w in (high[2, third], low[2, third]):
                        if w != 0.0:
                            s, t = two_product(p, w)
                            n = _add(parts, _add(parts, n, t), s)
                            s, t = two_product(q, w)
                            n = _add(parts, _add(parts, n, t), s)
    if n == 0:
        return 0
    return 1 if parts[n - 1] > 0.0 else -1


@njit(forceinline=False)
def side_of_plane(a, b, c, d):
    """Sign of det[b - a, c - a, d - a]: 1 where a, b, c are counter-clockwise seen from d, 0 in the plane."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    wx, wy, wz = d[0] - a[0], d[1] - a[1], d[2] - a[2]
    xy, yx, yz, zy, zx, xz = ux * vy, uy * vx, uy * vz, uz * vy, uz * vx, ux * vz
    det = wx * (yz - zy) + wy * (zx - xz) + wz * (xy - yx)
    size = abs(wx) * (abs(yz) + abs(zy)) + abs(wy) * (abs(zx) + abs(xz)) + abs(wz) * (abs(xy) + abs(yx))
    if det > _ERROR * size:
        return 1
    if det < -_ERROR * size:
        return -1
    if size == 0.0:
        # Each product is zero, because differences of float64 are zero only between equal numbers.
        return 0
    return _exact_sign(a, b, c, d)


@njit(forceinline=False)
def side_of_line(a, b, c):
    """Sign of det[b - a, c - a] in the plane: 1 where a, b, c are counter-clockwise."""
    flat = (a[0], a[1], 0.0)
    return side_of_plane(flat, (b[0], b[1], 0.0), (c[0], c[1], 0.0), (a[0], a[1], 1.0))
