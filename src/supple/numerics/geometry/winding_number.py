"""How many times closed surfaces wind around points: whether points are inside."""

import numpy as np

from supple.numerics.mat3 import cross, dot, row, subtract
from supple.runtime.kernel_cache import njit


@njit(cache=True)
def winding_number(x, triangles, q):
    """Of a closed surface of triangles (t, 3) of x (n, 3) about q: 1 inside, 0 outside, -1 inside an inward one."""
    total = 0.0
    for t in range(len(triangles)):
        total += half_solid_angle(x, triangles, t, q)
    return total / (2.0 * np.pi)


@njit
def half_solid_angle(x, triangles, t, q):
    """Of triangle t, seen from q. Source: van Oosterom, Strackee, "The solid angle of a plane triangle" (1983)."""
    a = subtract(row(x, triangles[t, 0]), q)
    b = subtract(row(x, triangles[t, 1]), q)
    c = subtract(row(x, triangles[t, 2]), q)
    la, lb, lc = np.sqrt(dot(a, a)), np.sqrt(dot(b, b)), np.sqrt(dot(c, c))
    det = dot(a, cross(b, c))
    return np.arctan2(det, la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb)
