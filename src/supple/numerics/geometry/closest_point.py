"""The point of a triangle that is closest to a point, in barycentric coordinates.

Source: Ericson, "Real-Time Collision Detection" (2005), section 5.1.5.
"""

from supple.numerics.mat3 import cross, dot, subtract
from supple.runtime.kernel_cache import njit


@njit
def closest_on_triangle(p, a, b, c):
    """Barycentric coordinates (three, zero or more, sum 1) of the point of triangle a b c that is closest to p."""
    ab, ac, ap = subtract(b, a), subtract(c, a), subtract(p, a)
    d1, d2 = dot(ab, ap), dot(ac, ap)
    if d1 <= 0.0 and d2 <= 0.0:
        return (1.0, 0.0, 0.0)
    bp = subtract(p, b)
    d3, d4 = dot(ab, bp), dot(ac, bp)
    if d3 >= 0.0 and d4 <= d3:
        return (0.0, 1.0, 0.0)
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0 and d1 > d3:
        t = d1 / (d1 - d3)
        return (1.0 - t, t, 0.0)
    cp = subtract(p, c)
    d5, d6 = dot(ab, cp), dot(ac, cp)
    if d6 >= 0.0 and d5 <= d6:
        return (0.0, 0.0, 1.0)
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0 and d2 > d6:
        t = d2 / (d2 - d6)
        return (1.0 - t, 0.0, t)
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 >= d3 and d5 >= d6 and d4 - d3 + d5 - d6 > 0.0:
        t = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return (0.0, 1.0 - t, t)
    total = va + vb + vc
    if not total > 0.0:  # a triangle without area, p beside none of its edges
        return (1.0, 0.0, 0.0)
    v, w = vb / total, vc / total
    return (1.0 - v - w, v, w)


@njit
def combine(u, a, b, c):
    """u0 a + u1 b + u2 c"""
    return (
        u[0] * a[0] + u[1] * b[0] + u[2] * c[0],
        u[0] * a[1] + u[1] * b[1] + u[2] * c[1],
        u[0] * a[2] + u[1] * b[2] + u[2] * c[2],
    )


@njit
def area_normal(a, b, c):
    """Twice the area times the normal of triangle a b c."""
    return cross(subtract(b, a), subtract(c, a))


@njit
def between(a, b, t):
    """(1 - t) a + t b"""
    return (a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2]))


@njit
def square_from_box(q, a, b, c):
    """The squared distance of a point from the box of a triangle."""
    square = 0.0
    for j in range(3):
        low, high = min(a[j], b[j], c[j]), max(a[j], b[j], c[j])
        square += max(0.0, low - q[j], q[j] - high) ** 2
    return square
