"""Rows of contact between rigid bodies, reduced to the two bodies: what an impulse moves does not change in a substep.

The points of such a row are on one or two rigid bodies, or nothing moves them. With the sums of the coefficients c_i of
the points on a body, its share C, and of c_i times their arms, its arm A, the relative motion over the substep is

    slip = slip_0 + sum (C u + th x A)

over the bodies, with their twists (u, th), see `movers`. An impulse d displaces a body by w C d and turns it by
J (A - f r_prev) x d: r_prev x d is the moment that `impulses` takes away, f of it from this body. So a sweep needs
neither points nor weights.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.numerics.kernel_cache import njit
from supple.numerics.mat3 import cross, dot, row, subtract


class RigidRows(NamedTuple):
    """k rows, as kernels receive them.

    Attributes
    ----------
    bodies : (k, 2) the rigid bodies of each row, -1 for none; -2 for the first where the row has free vertices
    shares : (k, 2) C; arms : (k, 2, 3) A; levers : (k, 2, 3) A - f r_prev [m]
    turns : (k, 2, 3) how a unit push turns each body [1/(kg m)]
    slips : (k, 3) slip_0 [m]; answers : (k, 3) how the slip changes by a unit push [1/kg]
    softness : (k, 6) sum w C^2 1 - [A] J [A], symmetric: xx yy zz xy yz zx [1/kg]
    """

    bodies: NDArray[np.int32]
    shares: NDArray[np.float64]
    arms: NDArray[np.float64]
    levers: NDArray[np.float64]
    turns: NDArray[np.float64]
    slips: NDArray[np.float64]
    answers: NDArray[np.float64]
    softness: NDArray[np.float64]


@njit(error_model="numpy")
def empty_rows(k):
    """Rows to be prepared."""
    return RigidRows(
        np.empty((k, 2), dtype=np.int32),
        np.zeros((k, 2)),
        np.zeros((k, 2, 3)),
        np.empty((k, 2, 3)),
        np.empty((k, 2, 3)),
        np.empty((k, 3)),
        np.empty((k, 3)),
        np.empty((k, 6)),
    )


@njit(error_model="numpy")
def _entry(a, k, j):
    return (a[k, j, 0], a[k, j, 1], a[k, j, 2])


@njit(error_model="numpy")
def _turned(J, b, m):
    """J m of body b."""
    return (
        J[b, 0, 0] * m[0] + J[b, 0, 1] * m[1] + J[b, 0, 2] * m[2],
        J[b, 1, 0] * m[0] + J[b, 1, 1] * m[1] + J[b, 1, 2] * m[2],
        J[b, 2, 0] * m[0] + J[b, 2, 1] * m[1] + J[b, 2, 2] * m[2],
    )


@njit(error_model="numpy")
def _join_points(rows, k, places, movers, vertices, weights, e):
    """Sum up the points; returns whether all are rigid or held, f, and sum c_i x_i at the places, without twists."""
    x, x_prev = places
    bodies, count, couple = rows.bodies, 0, 1.0
    bodies[k, 0] = bodies[k, 1] = -1
    now, before = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for i in range(4):
        p, c = vertices[e, i], weights[e, i]
        b = movers.body[p]
        if b < 0:
            if movers.inverse_masses[p] != 0.0:
                return False, 0.0, now, before
            couple = 0.0
        else:
            j = 0
            while j < count and bodies[k, j] != b:
                j += 1
            if j == 2:
                return False, 0.0, now, before
            count = max(count, j + 1)
            bodies[k, j] = b
            rows.shares[k, j] += c
            for a in range(3):
                rows.arms[k, j, a] += c * movers.arms[p, a]
            if movers.w[b] == 0.0:
                couple = 0.0
        now = (now[0] + c * x[p, 0], now[1] + c * x[p, 1], now[2] + c * x[p, 2])
        before = (before[0] + c * x_prev[p, 0], before[1] + c * x_prev[p, 1], before[2] + c * x_prev[p, 2])
    return True, couple if count == 1 else 0.5 * couple, now, before


@njit(error_model="numpy")
def prepare_row(rows, k, places, movers, vertices, weights, e, n):
    """Set the row k from the contact e with the normal n, at places x, x_prev (n, 3) without twists [m].

    Bodies have no twists yet, but shifts. Returns whether the row is between rigid bodies; what a unit push changes
    the relative place by along n [1/kg]; and the relative place at the beginning of the substep [m].
    """
    whole, couple, now, before = _join_points(rows, k, places, movers, vertices, weights, e)
    if not whole:
        rows.bodies[k, 0] = -2
        return False, 0.0, before
    slip = subtract(now, before)
    for j in range(2):
        b = rows.bodies[k, j]
        if b >= 0:
            c, t = rows.shares[k, j], movers.twists
            before = (before[0] + c * t[b, 6], before[1] + c * t[b, 7], before[2] + c * t[b, 8])
    xx = yy = zz = xy = yz = zx = 0.0
    answer = (0.0, 0.0, 0.0)
    for j in range(2):
        b = rows.bodies[k, j]
        if b < 0:
            continue
        A, w = _entry(rows.arms, k, j), movers.w[b] * rows.shares[k, j] ** 2
        lever = (A[0] - couple * before[0], A[1] - couple * before[1], A[2] - couple * before[2])
        turn = _turned(movers.J, b, cross(lever, n))
        spun = cross(turn, A)
        answer = (answer[0] + w * n[0] + spun[0], answer[1] + w * n[1] + spun[1], answer[2] + w * n[2] + spun[2])
        # Columns of -[A] J [A]: (J (A x e)) x A.
        p = cross(_turned(movers.J, b, (0.0, A[2], -A[1])), A)
        q = cross(_turned(movers.J, b, (-A[2], 0.0, A[0])), A)
        r = cross(_turned(movers.J, b, (A[1], -A[0], 0.0)), A)
        xx, yy, zz = xx + w + p[0], yy + w + q[1], zz + w + r[2]
        xy, yz, zx = xy + p[1], yz + q[2], zx + r[0]
        for a in range(3):
            rows.levers[k, j, a], rows.turns[k, j, a] = lever[a], turn[a]
    S = rows.softness
    S[k, 0], S[k, 1], S[k, 2], S[k, 3], S[k, 4], S[k, 5] = xx, yy, zz, xy, yz, zx
    for a in range(3):
        rows.slips[k, a], rows.answers[k, a] = slip[a], answer[a]
    return True, softness_along(rows, k, n), before


@njit(error_model="numpy")
def _moved(rows, k, twists):
    """sum (C u + th x A)"""
    x = y = z = 0.0
    for j in range(2):
        b = rows.bodies[k, j]
        if b >= 0:
            share = rows.shares[k, j]
            spun = cross((twists[b, 3], twists[b, 4], twists[b, 5]), _entry(rows.arms, k, j))
            x += share * twists[b, 0] + spun[0]
            y += share * twists[b, 1] + spun[1]
            z += share * twists[b, 2] + spun[2]
    return (x, y, z)


@njit(error_model="numpy")
def slip_of(rows, k, movers):
    """The relative motion over the substep [m]."""
    moved, slip = _moved(rows, k, movers.twists), row(rows.slips, k)
    return (slip[0] + moved[0], slip[1] + moved[1], slip[2] + moved[2])


@njit(error_model="numpy")
def softness_along(rows, k, t):
    """The square of the vector t (3,), times the change of the relative place along it by a unit impulse along it."""
    S = rows.softness
    x = S[k, 0] * t[0] + S[k, 3] * t[1] + S[k, 5] * t[2]
    y = S[k, 3] * t[0] + S[k, 1] * t[1] + S[k, 4] * t[2]
    z = S[k, 5] * t[0] + S[k, 4] * t[1] + S[k, 2] * t[2]
    return dot((x, y, z), t)


@njit(error_model="numpy")
def push_bodies(rows, k, movers, n, more, d):
    """Move the bodies by the impulse more n + d [kg m], d along the surface."""
    twists = movers.twists
    for j in range(2):
        b = rows.bodies[k, j]
        if b >= 0:
            f = movers.w[b] * rows.shares[k, j]
            turn = _turned(movers.J, b, cross(_entry(rows.levers, k, j), d))
            for a in range(3):
                twists[b, a] += f * (more * n[a] + d[a])
                twists[b, 3 + a] += more * rows.turns[k, j, a] + turn[a]
