"""How far apart two triangles are that do not meet: in floating point, relative error a few units of round-off."""

import numpy as np

from supple.runtime.kernel_cache import njit


@njit(forceinline=False)
def dot(u, v):
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


@njit(forceinline=False)
def minus(u, v):
    return (u[0] - v[0], u[1] - v[1], u[2] - v[2])


@njit(forceinline=False)
def cross(u, v):
    return (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])


@njit(forceinline=False)
def _along(p, a, ab, t):
    d = (a[0] + t * ab[0] - p[0], a[1] + t * ab[1] - p[1], a[2] + t * ab[2] - p[2])
    return dot(d, d)


@njit(forceinline=False)
def point_segment(p, a, b):
    """Squared distance of a point and a segment."""
    ab, ap = minus(b, a), minus(p, a)
    length = dot(ab, ab)
    t = 0.0 if length == 0.0 else min(1.0, max(0.0, dot(ap, ab) / length))
    return _along(p, a, ab, t)


@njit(forceinline=False)
def point_triangle(p, a, b, c):
    """Squared distance of a point and a triangle."""
    ab, ac, ap = minus(b, a), minus(c, a), minus(p, a)
    n = cross(ab, ac)
    size = dot(n, n)
    best = min(point_segment(p, a, b), point_segment(p, b, c), point_segment(p, c, a))
    if size > 0.0:
        v, w = dot(cross(ap, ac), n) / size, dot(cross(ab, ap), n) / size
        if v >= 0.0 and w >= 0.0 and v + w <= 1.0:
            # The way to the foot, however badly a sliver defines it, is never shorter than the distance.
            d = (v * ab[0] + w * ac[0] - ap[0], v * ab[1] + w * ac[1] - ap[1], v * ab[2] + w * ac[2] - ap[2])
            best = min(best, dot(d, d))
    return best


@njit(forceinline=False)
def segment_segment(p, q, a, b):
    """Squared distance of two segments."""
    u, v, r = minus(q, p), minus(b, a), minus(a, p)
    n = cross(u, v)
    size = dot(n, n)
    best = min(point_segment(p, a, b), point_segment(q, a, b), point_segment(a, p, q), point_segment(b, p, q))
    if size > 0.0:
        # The feet of the common perpendicular, where both lie within the segments.
        s, t = dot(cross(r, v), n) / size, dot(cross(r, u), n) / size
        if 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0:
            d = (r[0] + t * v[0] - s * u[0], r[1] + t * v[1] - s * u[1], r[2] + t * v[2] - s * u[2])
            best = min(best, dot(d, d))
    return best


@njit(forceinline=False)
def _corners(x, t):
    return (
        (x[t[0], 0], x[t[0], 1], x[t[0], 2]),
        (x[t[1], 0], x[t[1], 1], x[t[1], 2]),
        (x[t[2], 0], x[t[2], 1], x[t[2], 2]),
    )


@njit(cache=True)
def triangles_apart(x, s, t):
    """Squared distance of two triangles, three rows of x each, that do not meet."""
    A, B = _corners(x, s), _corners(x, t)
    best = np.inf
    for i in range(3):
        best = min(best, point_triangle(A[i], B[0], B[1], B[2]), point_triangle(B[i], A[0], A[1], A[2]))
        for j in range(3):
            best = min(best, segment_segment(A[i], A[(i + 1) % 3], B[j], B[(j + 1) % 3]))
    return best
