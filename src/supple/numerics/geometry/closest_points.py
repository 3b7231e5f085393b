"""The points of a triangle and of segments that are closest to a point, and to each other.

Of two segments, the parameters of the lines' closest points come from cross products, which stay precise where the
lines are almost parallel: a a' - b b' of the usual formula loses all digits there.

Source: Ericson, "Real-Time Collision Detection" (2005), sections 5.1.5 and 5.1.9, for the cases.
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
def closest_on_segments(a, b, c, d):
    """s and t in [0, 1]: (1 - s) a + s b and (1 - t) c + t d are closest to each other.

    For parallel segments, with many closest pairs, one of the pairs contains an end.
    """
    u, v, w = subtract(b, a), subtract(d, c), subtract(c, a)
    uu, vv = dot(u, u), dot(v, v)
    s, t, least = _nearer(u, v, w, 0.0, _share(dot(w, v), -vv), 0.0, 0.0, dot(w, w))
    s, t, least = _nearer(u, v, w, 1.0, _share(dot(w, v) - dot(u, v), -vv), s, t, least)
    s, t, least = _nearer(u, v, w, _share(dot(w, u), uu), 0.0, s, t, least)
    s, t, least = _nearer(u, v, w, _share(dot(w, u) + dot(v, u), uu), 1.0, s, t, least)
    n = cross(u, v)
    nn = dot(n, n)
    if nn > 0.0:
        p, q = dot(cross(w, v), n) / nn, dot(cross(w, u), n) / nn
        if 0.0 < p < 1.0 and 0.0 < q < 1.0:
            s, t, least = _nearer(u, v, w, p, q, s, t, least)
    return s, t


@njit
def _share(part, whole):
    """part / whole, limited to [0, 1]; 0 where the whole is 0."""
    if whole == 0.0:
        return 0.0
    return min(max(part / whole, 0.0), 1.0)


@njit
def _nearer(u, v, w, p, q, s, t, least):
    """The nearer pair of parameters, and its squared distance."""
    r = (p * u[0] - q * v[0] - w[0], p * u[1] - q * v[1] - w[1], p * u[2] - q * v[2] - w[2])
    square = dot(r, r)
    if square < least:
        return p, q, square
    return s, t, least
