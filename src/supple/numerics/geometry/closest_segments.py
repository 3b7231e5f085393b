"""The points of two segments that are closest to each other.

The parameters of the two lines' closest points come from cross products, which stay precise where the lines are almost
parallel: a a' - b b' of the usual formula loses all digits there.

Source: Ericson, "Real-Time Collision Detection" (2005), section 5.1.9, for the cases.
"""

from supple.numerics.mat3 import cross, dot, subtract
from supple.runtime.kernel_cache import njit


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
