"""Whether two triangles meet: exact, closed (touching counts), and aware of the corners that neighbours share.

Two convex sets that share a corner and another point share the way between them, which ends on the side opposite to the
corner in one of the two: so neighbours with one common corner meet elsewhere if and only if the opposite side of one
meets the other. Neighbours with a common side meet elsewhere if and only if one is folded flat onto the other.

A triangle without area is not a surface; what is left of it here is its sides. Its tetrahedron is flat, which is
found.
"""

from supple.results.check.geometry.orientation import area_sign, volume_sign
from supple.runtime.kernel_cache import njit


@njit(forceinline=False)
def _visible_axes(x, a, b, c):
    """Two coordinates in which the triangle has area, and the sign of that area; (-1, -1, 0) where there are none."""
    for i, j in ((0, 1), (1, 2), (2, 0)):
        sign = area_sign(x, a, b, c, i, j)
        if sign != 0:
            return i, j, sign
    return -1, -1, 0


@njit(forceinline=False)
def _point_in_flat_triangle(x, p, a, b, c, i, j, sign):
    return (
        area_sign(x, a, b, p, i, j) * sign >= 0
        and area_sign(x, b, c, p, i, j) * sign >= 0
        and area_sign(x, c, a, p, i, j) * sign >= 0
    )


@njit(forceinline=False)
def _flat_segments_meet(x, p, q, a, b, i, j):
    """Whether two segments in a plane have a point in common, one that no end decides: collinear ones do not count,
    as an end of one lies in the other then."""
    at_a, at_b = area_sign(x, p, q, a, i, j), area_sign(x, p, q, b, i, j)
    if at_a * at_b > 0 or (at_a == 0 and at_b == 0):
        return False
    return area_sign(x, a, b, p, i, j) * area_sign(x, a, b, q, i, j) <= 0


@njit(forceinline=False)
def segment_meets_triangle(x, p, q, a, b, c):
    """Whether the closed segment and the closed triangle have a point in common."""
    at_p, at_q = volume_sign(x, a, b, c, p), volume_sign(x, a, b, c, q)
    if at_p * at_q > 0:
        return False
    if at_p == 0 and at_q == 0:
        i, j, sign = _visible_axes(x, a, b, c)
        if sign == 0:
            return False
        return (
            _point_in_flat_triangle(x, p, a, b, c, i, j, sign)
            or _point_in_flat_triangle(x, q, a, b, c, i, j, sign)
            or _flat_segments_meet(x, p, q, a, b, i, j)
            or _flat_segments_meet(x, p, q, b, c, i, j)
            or _flat_segments_meet(x, p, q, c, a, i, j)
        )
    first = volume_sign(x, p, q, a, b)
    second = volume_sign(x, p, q, b, c)
    if first * second < 0:
        return False
    third = volume_sign(x, p, q, c, a)
    return first * third >= 0 and second * third >= 0


@njit(forceinline=False)
def _one_side(x, s, t):
    """Whether the corners of t are all strictly on one side of the plane of s."""
    sign = volume_sign(x, s[0], s[1], s[2], t[0])
    return sign != 0 and volume_sign(x, s[0], s[1], s[2], t[1]) == sign == volume_sign(x, s[0], s[1], s[2], t[2])


@njit(forceinline=False)
def _strangers_meet(x, s, t):
    if _one_side(x, s, t) or _one_side(x, t, s):
        return False
    for k in range(3):
        if segment_meets_triangle(x, s[k], s[(k + 1) % 3], t[0], t[1], t[2]):
            return True
        if segment_meets_triangle(x, t[k], t[(k + 1) % 3], s[0], s[1], s[2]):
            return True
    return False


@njit(forceinline=False)
def _corner(s, t, common):
    """Which corner of s is the first that is a corner of t, or that is not."""
    for k in range(3):
        if (s[k] == t[0] or s[k] == t[1] or s[k] == t[2]) == common:
            return k
    return 0


@njit(forceinline=False)
def shared_corners(s, t):
    """How many corners two triangles have in common."""
    shared = 0
    for i in range(3):
        for j in range(3):
            shared += s[i] == t[j]
    return shared


@njit(forceinline=False)
def triangles_meet(x, s, t):
    """Whether two triangles, three rows of x each, have more in common than the corners and sides that they share."""
    shared = shared_corners(s, t)
    if shared == 0:
        return _strangers_meet(x, s, t)
    if shared == 3:
        return True
    i, j = _corner(s, t, shared == 1), _corner(t, s, shared == 1)
    a, b, c = s[(i + 1) % 3], s[(i + 2) % 3], s[i]
    if shared == 1:
        p, q = t[(j + 1) % 3], t[(j + 2) % 3]
        return segment_meets_triangle(x, a, b, c, p, q) or segment_meets_triangle(x, p, q, c, a, b)
    # Whether they are folded onto each other along their common side a, b.
    if volume_sign(x, a, b, c, t[j]) != 0:
        return False
    k, m, sign = _visible_axes(x, a, b, c)
    return sign != 0 and area_sign(x, a, b, t[j], k, m) == sign
