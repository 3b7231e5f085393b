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
    return (
        area_sign(x, p, q, a, i, j) * area_sign(x, p, q, b, i, j) <= 0
        and area_sign(x, a, b, p, i, j) * area_sign(x, a, b, q, i, j) <= 0
        and not (area_sign(x, p, q, a, i, j) == 0 and area_sign(x, p, q, b, i, j) == 0)
    )


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
def _one_side(x, a, b, c, p, q, r):
    """Whether p, q, r are all strictly on one side of the plane of a, b, c."""
    sign = volume_sign(x, a, b, c, p)
    return sign != 0 and volume_sign(x, a, b, c, q) == sign and volume_sign(x, a, b, c, r) == sign


@njit(forceinline=False)
def _strangers_meet(x, a, b, c, p, q, r):
    if _one_side(x, a, b, c, p, q, r) or _one_side(x, p, q, r, a, b, c):
        return False
    return (
        segment_meets_triangle(x, p, q, a, b, c)
        or segment_meets_triangle(x, q, r, a, b, c)
        or segment_meets_triangle(x, r, p, a, b, c)
        or segment_meets_triangle(x, a, b, p, q, r)
        or segment_meets_triangle(x, b, c, p, q, r)
        or segment_meets_triangle(x, c, a, p, q, r)
    )


@njit(forceinline=False)
def _common_corner(s, t):
    """Of two triangles with one common corner: that one, and the opposite sides (c, a, b, p, q)."""
    for i in range(3):
        for j in range(3):
            if s[i] == t[j]:
                return s[i], s[(i + 1) % 3], s[(i + 2) % 3], t[(j + 1) % 3], t[(j + 2) % 3]
    return s[0], s[1], s[2], t[1], t[2]


@njit(forceinline=False)
def _folded(x, s, t):
    """Whether two triangles with a common side lie on each other."""
    k = 0  # the corner of s that is not common
    while s[k] == t[0] or s[k] == t[1] or s[k] == t[2]:
        k += 1
    m = 0
    while t[m] == s[0] or t[m] == s[1] or t[m] == s[2]:
        m += 1
    a, b = s[(k + 1) % 3], s[(k + 2) % 3]
    if volume_sign(x, a, b, s[k], t[m]) != 0:
        return False
    i, j, sign = _visible_axes(x, a, b, s[k])
    return sign != 0 and area_sign(x, a, b, t[m], i, j) == sign


@njit(forceinline=False)
def triangles_meet(x, s, t):
    """Whether two triangles, three rows of x each, have more in common than the corners and sides that they share."""
    shared = 0
    for i in range(3):
        for j in range(3):
            shared += s[i] == t[j]
    if shared == 0:
        return _strangers_meet(x, s[0], s[1], s[2], t[0], t[1], t[2])
    if shared == 1:
        c, a, b, p, q = _common_corner(s, t)
        return segment_meets_triangle(x, a, b, c, p, q) or segment_meets_triangle(x, p, q, c, a, b)
    if shared == 2:
        return _folded(x, s, t)
    return True
