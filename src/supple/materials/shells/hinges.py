"""Angles between the two triangles at an edge, with their first and second derivatives, and Hessians of bending.

A hinge is (i, j, k, l): the edge runs from i to j as in the triangle of k, and l is the third corner of the other one.
With e = x_j - x_i and the normals n_1 = e x (x_k - x_i), n_2 = (x_l - x_i) x e of the two triangles, the angle is that
from n_1 to n_2 about e, zero where they are in one plane. Its derivatives by the wings are

    d theta/dx_k = -|e| n_1/|n_1|^2,    d theta/dx_l = -|e| n_2/|n_2|^2,

and those by the ends of the edge follow, as a turn of a wing about the edge is the same as a motion of the ends.

Source: Tamstorf, Grinspun, "Discrete bending forces and their Jacobians" (2013).

Hessians are those of six nodes: of a triangle, its corners, and those beyond its edges from corner 0, 1, 2 to the next.
The block (3, 3) of nodes p <= q of triangle t is number 21 t + 6 p + q - p (p + 1) / 2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.runtime.kernel_cache import njit

Floats = NDArray[np.float64]


def angles_of(x: Floats, hinges: NDArray[np.int32]) -> Floats:
    """(e,) from -pi to pi, of hinges (e, 4) at positions x (n, 3) [rad]."""
    out = np.empty(len(hinges))
    if len(hinges):
        _put_angles(x, hinges, out)
    return out


def turns_of(x: Floats, hinges: NDArray[np.int32]) -> Floats:
    """(e, 4, 3) the derivatives of the angles [rad/m]."""
    out = np.empty((len(hinges), 4, 3))
    if len(hinges):
        _put_turns(x, hinges, out)
    return out


@njit
def _cross(a0, a1, a2, b0, b1, b2):
    return a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0


@njit
def _between(x, a, b):
    return x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]


@njit
def _square(a):
    return a[0] * a[0] + a[1] * a[1] + a[2] * a[2]


@njit
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def _put_angles(x, hinges, out):
    for h in range(len(hinges)):
        i = hinges[h, 0]
        e = _between(x, i, hinges[h, 1])
        n = _cross(*e, *_between(x, i, hinges[h, 2]))
        m = _cross(*_between(x, i, hinges[h, 3]), *e)
        out[h] = np.arctan2(_dot(_cross(*n, *m), e), _square(e) ** 0.5 * _dot(n, m))


@njit(cache=True)
def _put_turns(x, hinges, out):
    for h in range(len(hinges)):
        i = hinges[h, 0]
        e = _between(x, i, hinges[h, 1])
        square = _square(e)
        for c in range(3):
            out[h, 0, c] = out[h, 1, c] = 0.0
        for side in range(2):
            arm = _between(x, i, hinges[h, 2 + side])
            n = _cross(*e, *arm)
            factor = (2.0 * side - 1.0) * square**0.5 / _square(n)
            at = _dot(arm, e) / square
            for c in range(3):
                wing = factor * n[c]
                out[h, 2 + side, c] = wing
                out[h, 0, c] -= (1.0 - at) * wing
                out[h, 1, c] -= at * wing


@njit
def _add(out, t, p, q, i, j, value):
    """To entry (i, j) of the block of nodes p and q, which is kept from the lower node to the higher one."""
    if p <= q:
        out[21 * t + 6 * p + q - p * (p + 1) // 2, i, j] += value
    else:
        out[21 * t + 6 * q + p - q * (q + 1) // 2, j, i] += value


@njit(cache=True)
def add_bending(hinge_of, places, bounds, scale, turns, out):
    """J^T P J: P (t, 3, 3) of a triangle's hinges, J their derivatives `turns` (e, 4, 3), see `ShellElements`."""
    half = np.empty((4, 3))
    for t in range(len(hinge_of)):
        for k in range(3):
            e = hinge_of[t, k]
            if e < 0:
                continue
            for m in range(3):
                f = hinge_of[t, m]
                if f < 0:
                    continue
                factor = bounds[t, k, m] * (scale[e] * scale[f]) ** 0.5
                for b in range(4):
                    for j in range(3):
                        half[b, j] = factor * turns[f, b, j]
                for a in range(4):
                    p = places[t, k, a]
                    for b in range(4):
                        q = places[t, m, b]
                        if p <= q:
                            n = 21 * t + 6 * p + q - p * (p + 1) // 2
                            for i in range(3):
                                for j in range(3):
                                    out[n, i, j] += turns[e, a, i] * half[b, j]


@njit(cache=True)
def add_turning(x, hinges, hinge_of, owned, places, moments, out):
    """sum m_e d^2 theta_e, each in the triangle that `owned` (t, 3) says; see `hinges`."""
    e, n, upright, arm, wing, of_at = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty((3, 3))
    of_wing, v, R = np.empty((3, 3, 3)), np.empty(3), np.empty((3, 3))
    for t in range(len(hinge_of)):
        for k in range(3):
            h = hinge_of[t, k]
            if not owned[t, k]:
                continue
            for i in range(3):
                e[i] = x[hinges[h, 1], i] - x[hinges[h, 0], i]
            square = e[0] ** 2 + e[1] ** 2 + e[2] ** 2
            length = square**0.5
            for side in range(2):
                sign = 1.0 - 2.0 * side
                for i in range(3):
                    arm[i] = x[hinges[h, 2 + side], i] - x[hinges[h, 0], i]
                area = along = 0.0
                for i in range(3):
                    j, m = (i + 1) % 3, (i + 2) % 3
                    n[i] = sign * (e[j] * arm[m] - e[m] * arm[j])
                    area += n[i] * n[i]
                    along += arm[i] * e[i]
                at = along / square
                for i in range(3):
                    upright[i] = n[i] / area
                    wing[i] = -length * upright[i]
                    of_at[0, i] = (2.0 * at * e[i] - e[i] - arm[i]) / square
                    of_at[1, i] = (arm[i] - 2.0 * at * e[i]) / square
                    of_at[2, i] = e[i] / square
                for i in range(3):
                    for j in range(3):
                        R[i, j] = -sign * length / area * ((1.0 if i == j else 0.0) - 2.0 * n[i] * upright[j])
                for q in range(3):
                    for i in range(3):
                        v[i] = arm[i] - e[i] if q == 0 else (-arm[i] if q == 1 else e[i])
                    stretched = 1.0 if q == 0 else (-1.0 if q == 1 else 0.0)
                    for i in range(3):  # R times the matrix of w -> v x w
                        of_wing[q, i, 0] = R[i, 1] * v[2] - R[i, 2] * v[1]
                        of_wing[q, i, 1] = R[i, 2] * v[0] - R[i, 0] * v[2]
                        of_wing[q, i, 2] = R[i, 0] * v[1] - R[i, 1] * v[0]
                        for j in range(3):
                            of_wing[q, i, j] += stretched * upright[i] * e[j] / length
                for q in range(3):
                    second = places[t, k, q] if q < 2 else places[t, k, 2 + side]
                    for o in range(q + 1):
                        first = places[t, k, o] if o < 2 else places[t, k, 2 + side]
                        for i in range(3):
                            for j in range(3):
                                change, turn = of_wing[q, i, j], wing[i] * of_at[q, j]
                                if o == 0:
                                    change = turn - (1.0 - at) * change
                                elif o == 1:
                                    change = -turn - at * change
                                _add(out, t, first, second, i, j, moments[h] * change)


@njit(cache=True)
def hinge_products(turns, hinges, x, out):
    """J x (e,) of x (n, 3)."""
    for e in range(len(hinges)):
        total = 0.0
        for a in range(4):
            for i in range(3):
                total += turns[e, a, i] * x[hinges[e, a], i]
        out[e] = total


@njit(cache=True)
def add_hinge_forces(turns, hinges, moments, out):
    """out (n, 3) += J^T m."""
    for e in range(len(hinges)):
        for a in range(4):
            for i in range(3):
                out[hinges[e, a], i] += moments[e] * turns[e, a, i]


@njit(cache=True)
def subtract_bounds(hinge_of, bounds, turned, out):
    """out (e,) -= P x, of P (t, 3, 3) of the hinges of each triangle and x = turned (e,)."""
    for t in range(len(hinge_of)):
        for k in range(3):
            for m in range(3):
                if hinge_of[t, k] >= 0 and hinge_of[t, m] >= 0:
                    out[hinge_of[t, k]] -= bounds[t, k, m] * turned[hinge_of[t, m]]
