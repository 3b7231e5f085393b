"""The vector between the two closest points of a pair, and how it turns when the points of the pair move.

A pair has up to four points x_i with coefficients c_i (sum 0): r = sum_i c_i x_i is the vector from the second side to
the first. The coefficients depend on up to two free parameters, the coordinates of the closest points in an edge or a
triangle; R_k = sum_i D_ki x_i is the derivative of r by parameter k, and r . R_k = 0 at the closest points.

| kind | points | coefficients | parameters |
|---|---|---|---|
| vertex and vertex | p, q | 1, -1 | none |
| vertex and edge | p, a, b | 1, t - 1, -t | t |
| vertex and triangle | p, a, b, c | 1, u + v - 1, -u, -v | u, v |
| edge and edge | a, b, c, d | 1 - s, s, t - 1, -t | s, t |
| vertex and plane | as vertex and triangle, with any u, v | | u, v |
"""

import math

from supple.numerics.mat3 import cross, dot, jacobi_rotation, subtract
from supple.runtime.kernel_cache import njit

VERTEX_VERTEX, VERTEX_EDGE, VERTEX_TRIANGLE, EDGE_EDGE, VERTEX_PLANE = 0, 1, 2, 3, 4

_NONE = (0.0, 0.0, 0.0, 0.0)


@njit
def point_count(kind):
    """How many points a pair of a kind has."""
    return min(kind + 2, 4)


@njit
def corners(kind, triangles, edges, i, j):
    """The four points of vertex i and triangle j, or of the edges i and j."""
    if kind == EDGE_EDGE:
        return edges[i, 0], edges[i, 1], edges[j, 0], edges[j, 1]
    return i, triangles[j, 0], triangles[j, 1], triangles[j, 2]


@njit
def unit(a):
    """a / |a|, or zero."""
    length = math.sqrt(dot(a, a))
    if length == 0.0:
        return (0.0, 0.0, 0.0)
    return (a[0] / length, a[1] / length, a[2] / length)


@njit
def any_across(n):
    """A unit vector perpendicular to the unit vector n."""
    if abs(n[0]) <= abs(n[1]) and abs(n[0]) <= abs(n[2]):
        return unit((0.0, -n[2], n[1]))
    if abs(n[1]) <= abs(n[2]):
        return unit((n[2], 0.0, -n[0]))
    return unit((-n[1], n[0], 0.0))


@njit
def tangent_modes(kind, n, a, b, c, d):
    """Two perpendicular unit vectors q across n, and how a displacement along n shifts the closest points along them.

    Let the point i move by h_i n. The closest points then move against each other, along q_k, by minus
    |r| sum_i D_ki h_i, where D_k is a combination of the derivatives of the coefficients. The q are chosen such that
    D_0 . D_1 = 0.

    Parameters
    ----------
    kind : see the module; n : r / |r|
    a, b, c, d : the points; those that the kind does not have are ignored

    Returns
    -------
    q0, D0, w0, q1, D1, w1 : q (three), D (four) [1/m] and w = D . D [1/m^2], 0 where no parameter moves along q
    """
    if kind == VERTEX_VERTEX:
        q = any_across(n)
        return q, _NONE, 0.0, cross(n, q), _NONE, 0.0
    if kind == VERTEX_EDGE:
        R = subtract(b, c)
        length = math.sqrt(dot(R, R))
        q = (R[0] / length, R[1] / length, R[2] / length)
        D = (0.0, 1.0 / length, -1.0 / length, 0.0)
        return q, D, 2.0 / (length * length), cross(n, q), _NONE, 0.0
    if kind in (VERTEX_TRIANGLE, VERTEX_PLANE):
        # D_u = (0, 1, -1, 0) and D_v = (0, 1, 0, -1)
        return _perpendicular_modes(subtract(b, c), subtract(b, d), (0.0, 1.0, -1.0, 0.0), (0.0, 1.0, 0.0, -1.0))
    return _perpendicular_modes(subtract(b, a), subtract(c, d), (-1.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, -1.0))


@njit
def _perpendicular_modes(R0, R1, D0, D1):
    """The modes of two parameters: combinations A such that R A is orthonormal and the columns of D A perpendicular."""
    # The factor L of G = R^T R = L L^T; its last entry from the cross product, which keeps its digits in slivers.
    l00 = math.sqrt(dot(R0, R0))
    l10 = dot(R0, R1) / l00
    n = cross(R0, R1)
    l11 = math.sqrt(dot(n, n)) / l00
    # M = L^-1 N L^-T with N = D D^T, whose diagonal is 2.
    mixed = D0[0] * D1[0] + D0[1] * D1[1] + D0[2] * D1[2] + D0[3] * D1[3]
    m00 = 2.0 / (l00 * l00)
    m01 = (mixed / l00 - l10 * m00) / l11
    m11 = (2.0 - 2.0 * l10 * mixed / l00 + l10 * l10 * m00) / (l11 * l11)
    cosine, sine, tangent = jacobi_rotation(m00, m11, m01)
    # Columns of A = L^-T Q.
    lower0, lower1 = -sine / l11, cosine / l11
    upper0, upper1 = (cosine - l10 * lower0) / l00, (sine - l10 * lower1) / l00
    return (
        _mixed3(upper0, R0, lower0, R1),
        _mixed4(upper0, D0, lower0, D1),
        m00 - tangent * m01,
        _mixed3(upper1, R0, lower1, R1),
        _mixed4(upper1, D0, lower1, D1),
        m11 + tangent * m01,
    )


@njit
def _mixed3(x, a, y, b):
    return (x * a[0] + y * b[0], x * a[1] + y * b[1], x * a[2] + y * b[2])


@njit
def _mixed4(x, a, y, b):
    return (x * a[0] + y * b[0], x * a[1] + y * b[1], x * a[2] + y * b[2], x * a[3] + y * b[3])
