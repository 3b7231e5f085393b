"""How a rigid body of four control points moves in a substep, as its momenta determine.

Within a substep the places x_n of its beginning are rigid, and everything that acts on the body changes the velocities
v of its control points. Its momenta are

    P = sum m v,   L = sum m r x v,   r = x_n - c,

and they determine the end of the substep: c moves by h P / M, and r turns by the rotation Q with

    sum m r x (Q r) = h L.

This is the discrete Euler equation of Moser and Veselov. It is symplectic, symmetric and of second order, so that the
energy of free rotation does not drift. With v = (x - x_n) / h, the angular momentum about the places of the end is the
same, because x - x_n is parallel to v: a free body keeps both momenta to round-off.

With the inertia tensor I of r and the unit quaternion (w, q) of Q the equation is 2 w I q + 2 q x (I q) = h L, which
Newton's method solves. It has a solution where a body turns by less than about one radian in a substep. Faster ones
turn by their angular velocity, with the same angular momentum.

Source: Moser, Veselov, "Discrete versions of some classical integrable systems" (1991); Leok, McClamroch, Lee, "A Lie
group variational integrator for the attitude dynamics of a rigid body" (2005), section 3.
"""

import math

import numpy as np

from supple.numerics.mat3 import cross, dot, row, subtract
from supple.runtime.kernel_cache import njit

# Newton's method ends where the quaternion changes by less than this, or after this many iterations.
_EXACT, _MOST_ITERATIONS = 1e-15, 10
# The largest |q| that is looked for; the sine of half of the angle.
_LARGEST = 0.6


@njit
def center_of(x, control, b):
    """Center (3,) of the control points of body b."""
    cx = cy = cz = 0.0
    for k in range(4):
        i = control[b, k]
        cx += 0.25 * x[i, 0]
        cy += 0.25 * x[i, 1]
        cz += 0.25 * x[i, 2]
    return (cx, cy, cz)


@njit
def inertia_of(x, control, b):
    """Center (3,) of the control points of body b, and sum r_k.r_k 1 - r_k r_k^T as six numbers: xx yy zz xy yz zx."""
    center = center_of(x, control, b)
    xx = yy = zz = xy = yz = zx = 0.0
    for k in range(4):
        r = subtract(row(x, control[b, k]), center)
        xx += r[0] * r[0]
        yy += r[1] * r[1]
        zz += r[2] * r[2]
        xy += r[0] * r[1]
        yz += r[1] * r[2]
        zx += r[2] * r[0]
    return center, (yy + zz, zz + xx, xx + yy, -xy, -yz, -zx)


@njit
def times(S, v):
    """S v of a symmetric matrix, given by xx yy zz xy yz zx."""
    return (
        S[0] * v[0] + S[3] * v[1] + S[5] * v[2],
        S[3] * v[0] + S[1] * v[1] + S[4] * v[2],
        S[5] * v[0] + S[4] * v[1] + S[2] * v[2],
    )


@njit
def solve(a, b, c, v):
    """The solution x of a.x = v0, b.x = v1, c.x = v2 for the rows a, b, c of a matrix."""
    bc, ca, ab = cross(b, c), cross(c, a), cross(a, b)
    det = dot(a, bc)
    return (
        (bc[0] * v[0] + ca[0] * v[1] + ab[0] * v[2]) / det,
        (bc[1] * v[0] + ca[1] * v[1] + ab[1] * v[2]) / det,
        (bc[2] * v[0] + ca[2] * v[1] + ab[2] * v[2]) / det,
    )


@njit
def solve_symmetric(S, v):
    """S^-1 v of a symmetric matrix, given by xx yy zz xy yz zx."""
    return solve((S[0], S[3], S[5]), (S[3], S[1], S[4]), (S[5], S[4], S[2]), v)


@njit
def half_turn(S, L):
    """The unit quaternion (w, q) with 2 w S q + 2 q x (S q) = L; see the module."""
    spin = solve_symmetric(S, L)
    q = (0.5 * spin[0], 0.5 * spin[1], 0.5 * spin[2])
    change = 1.0
    for _ in range(_MOST_ITERATIONS):
        square = dot(q, q)
        if not square < _LARGEST * _LARGEST:
            change = 1.0
            break
        if change <= _EXACT:
            break
        w = math.sqrt(1.0 - square)
        s = times(S, q)
        t = cross(q, s)
        miss = (2.0 * (w * s[0] + t[0]) - L[0], 2.0 * (w * s[1] + t[1]) - L[1], 2.0 * (w * s[2] + t[2]) - L[2])
        # Rows of 2 w S - 2 (S q) q^T / w + 2 [q] S - 2 [S q].
        f = 1.0 / w
        x, y, z = (S[0], S[3], S[5]), (S[3], S[1], S[4]), (S[5], S[4], S[2])
        a = (
            2.0 * (w * x[0] - f * s[0] * q[0] + q[1] * z[0] - q[2] * y[0]),
            2.0 * (w * x[1] - f * s[0] * q[1] + q[1] * z[1] - q[2] * y[1] + s[2]),
            2.0 * (w * x[2] - f * s[0] * q[2] + q[1] * z[2] - q[2] * y[2] - s[1]),
        )
        b = (
            2.0 * (w * y[0] - f * s[1] * q[0] + q[2] * x[0] - q[0] * z[0] - s[2]),
            2.0 * (w * y[1] - f * s[1] * q[1] + q[2] * x[1] - q[0] * z[1]),
            2.0 * (w * y[2] - f * s[1] * q[2] + q[2] * x[2] - q[0] * z[2] + s[0]),
        )
        c = (
            2.0 * (w * z[0] - f * s[2] * q[0] + q[0] * y[0] - q[1] * x[0] + s[1]),
            2.0 * (w * z[1] - f * s[2] * q[1] + q[0] * y[1] - q[1] * x[1] - s[0]),
            2.0 * (w * z[2] - f * s[2] * q[2] + q[0] * y[2] - q[1] * x[2]),
        )
        d = solve(a, b, c, miss)
        q = (q[0] - d[0], q[1] - d[1], q[2] - d[2])
        change = math.sqrt(dot(d, d))
    if not change < 1e-9:
        angle = math.sqrt(dot(spin, spin))
        f = math.sin(0.5 * angle) / angle
        return math.cos(0.5 * angle), (f * spin[0], f * spin[1], f * spin[2])
    return math.sqrt(1.0 - dot(q, q)), q


@njit
def spin_of(x, v, control, b):
    """How fast body b turns at places x (N, >= 3) with velocities v (N, 3) of its control points [rad/s]."""
    center, S = inertia_of(x, control, b)
    L = (0.0, 0.0, 0.0)
    for i in control[b]:
        moment = cross(subtract(row(x, i), center), row(v, i))
        L = (L[0] + moment[0], L[1] + moment[1], L[2] + moment[2])
    turn = solve_symmetric(S, L)
    return math.sqrt(dot(turn, turn))


@njit(cache=True)
def spins(x, v, control):
    """(b,) how fast all bodies turn; see `spin_of`."""
    return np.array([spin_of(x, v, control, b) for b in range(len(control))])


@njit(cache=True)
def advance(points, previous, velocities, control, h):
    ends = np.empty((4, 3))
    for b in range(len(control)):
        if points[control[b, 0], 3] == 0.0:
            for i in control[b]:
                for j in range(3):
                    velocities[i, j] = (points[i, j] - previous[i, j]) / h
            continue
        center, S = inertia_of(previous, control, b)
        mean, L = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        for i in control[b]:
            v = row(velocities, i)
            moment = cross(subtract(row(previous, i), center), v)
            mean = (mean[0] + 0.25 * v[0], mean[1] + 0.25 * v[1], mean[2] + 0.25 * v[2])
            L = (L[0] + moment[0], L[1] + moment[1], L[2] + moment[2])
        w, q = half_turn(S, (h * L[0], h * L[1], h * L[2]))
        shift, missing = (0.0, 0.0, 0.0), L
        for k in range(4):
            r = subtract(row(previous, control[b, k]), center)
            t = cross(q, r)
            t = (2.0 * t[0], 2.0 * t[1], 2.0 * t[2])
            u = cross(q, t)
            # Of the turn, as differences: velocities then have no round-off of the places divided by h.
            ends[k, 0], ends[k, 1], ends[k, 2] = w * t[0] + u[0], w * t[1] + u[1], w * t[2] + u[2]
            moment = cross(r, row(ends, k))
            shift = (shift[0] + 0.25 * ends[k, 0], shift[1] + 0.25 * ends[k, 1], shift[2] + 0.25 * ends[k, 2])
            missing = (missing[0] - moment[0] / h, missing[1] - moment[1] / h, missing[2] - moment[2] / h)
        # The remaining error of Newton's method.
        rest = solve_symmetric(S, missing)
        for k in range(4):
            i = control[b, k]
            r = subtract(row(previous, i), center)
            more = cross(rest, r)
            for j in range(3):
                points[i, j] = previous[i, j] + h * mean[j] + (ends[k, j] - shift[j])
                velocities[i, j] = mean[j] + (ends[k, j] - shift[j]) / h + more[j]
