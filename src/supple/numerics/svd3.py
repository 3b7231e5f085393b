"""Rotation-variant singular value decomposition of 3x3 matrices: F = U diag(s) V^T with det U = det V = +1.

The smallest singular value has the sign of det F, so that an inverted element has one negative stretch.
Method: one-sided Jacobi (Hestenes), which rotates the columns of F until they are orthogonal. Unlike an
eigendecomposition of F^T F it does not square the condition number: F is reproduced to round-off for any rank.

Sources: Golub, Van Loan, "Matrix Computations", section 8.6.3; Irving, Teran, Fedkiw, "Invertible Finite Elements"
(2004), section 5, for the sign convention.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SolverError
from supple.numerics.mat3 import cross, dot, load_mat, store_mat
from supple.runtime.kernel_cache import njit

# The remaining error is below round-off after a sweep whose rotation angles are all below 1e-8 and whose cosines
# between columns are all below 1e-9. (Both are needed: a small cosine needs a large angle where the lengths are nearly
# equal, and a large cosine needs only a small one where they are very different.) The constants are squares.
_SMALL_ANGLE = 1e-16
_SMALL_COSINE = 1e-18
_ORTHOGONAL = 1e-31
_MAX_SWEEPS = 20
# Matrices of which singular values are found at the same time.
_LANES = 16


@njit
def svd3(F):
    """Rotation-variant SVD of one matrix, for kernels.

    Parameters
    ----------
    F : nine numbers, row after row.

    Returns
    -------
    U, s, V : nine, three and nine numbers; s[0] >= s[1] >= |s[2]|, s[1] >= 0. Not-a-number where F is not finite.
    """
    largest = max(
        max(max(abs(F[0]), abs(F[1])), max(abs(F[2]), abs(F[3]))),
        max(max(abs(F[4]), abs(F[5])), max(max(abs(F[6]), abs(F[7])), abs(F[8]))),
    )
    if largest > 1e-60 and largest < 1e60:
        return _svd_of_scaled(F)
    if largest == 0.0:
        identity = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
        return identity, (0.0, 0.0, 0.0), identity
    # Scaling by a power of two is exact; squares of the scaled entries can neither overflow nor underflow.
    e = math.frexp(largest)[1] if largest < math.inf else 0
    U, s, V = _svd_of_scaled(
        (
            math.ldexp(F[0], -e),
            math.ldexp(F[1], -e),
            math.ldexp(F[2], -e),
            math.ldexp(F[3], -e),
            math.ldexp(F[4], -e),
            math.ldexp(F[5], -e),
            math.ldexp(F[6], -e),
            math.ldexp(F[7], -e),
            math.ldexp(F[8], -e),
        )
    )
    return U, (math.ldexp(s[0], e), math.ldexp(s[1], e), math.ldexp(s[2], e)), V


@njit
def _orthogonalize(p, q, vp, vq, done):
    """Rotate columns p, q of F V (and of V) until orthogonal; `done` becomes False where another sweep is needed."""
    app = dot(p, p)
    aqq = dot(q, q)
    apq = dot(p, q)
    size = app * aqq
    square = apq * apq
    if square > _ORTHOGONAL * size:
        d = aqq - app
        h = 2.0 * apq
        t = h / (abs(d) + math.sqrt(d * d + h * h))
        if d < 0.0:
            t = -t
        c = 1.0 / math.sqrt(1.0 + t * t)
        s = t * c
        p, q = (
            (c * p[0] - s * q[0], c * p[1] - s * q[1], c * p[2] - s * q[2]),
            (s * p[0] + c * q[0], s * p[1] + c * q[1], s * p[2] + c * q[2]),
        )
        vp, vq = (
            (c * vp[0] - s * vq[0], c * vp[1] - s * vq[1], c * vp[2] - s * vq[2]),
            (s * vp[0] + c * vq[0], s * vp[1] + c * vq[1], s * vp[2] + c * vq[2]),
        )
        done = done and t * t < _SMALL_ANGLE and square < _SMALL_COSINE * size
    return p, q, vp, vq, done


@njit
def _negated(a):
    return (-a[0], -a[1], -a[2])


@njit
def _svd_of_scaled(F):
    b0 = (F[0], F[3], F[6])
    b1 = (F[1], F[4], F[7])
    b2 = (F[2], F[5], F[8])
    v0 = (1.0, 0.0, 0.0)
    v1 = (0.0, 1.0, 0.0)
    v2 = (0.0, 0.0, 1.0)
    for _ in range(_MAX_SWEEPS):
        done = True
        b0, b1, v0, v1, done = _orthogonalize(b0, b1, v0, v1, done)
        b0, b2, v0, v2, done = _orthogonalize(b0, b2, v0, v2, done)
        b1, b2, v1, v2, done = _orthogonalize(b1, b2, v1, v2, done)
        if done:
            break

    # Longest column first. Each exchange changes one sign, so that det V stays +1.
    n0, n1, n2 = dot(b0, b0), dot(b1, b1), dot(b2, b2)
    if n0 < n1:
        b0, b1, v0, v1, n0, n1 = b1, _negated(b0), v1, _negated(v0), n1, n0
    if n1 < n2:
        b1, b2, v1, v2, n1, n2 = b2, _negated(b1), v2, _negated(v1), n2, n1
        if n0 < n1:
            b0, b1, v0, v1, n0, n1 = b1, _negated(b0), v1, _negated(v0), n1, n0

    s0 = math.sqrt(n0)
    u0 = (b0[0] / s0, b0[1] / s0, b0[2] / s0)
    u1 = _unit_orthogonal(b1, u0)
    u2 = cross(u0, u1)
    s1 = min(max(dot(u1, b1), 0.0), s0)
    s2 = min(max(dot(u2, b2), -s1), s1)
    U = (u0[0], u1[0], u2[0], u0[1], u1[1], u2[1], u0[2], u1[2], u2[2])
    V = (v0[0], v1[0], v2[0], v0[1], v1[1], v2[1], v0[2], v1[2], v2[2])
    return U, (s0, s1, s2), V


@njit
def _unit_orthogonal(b, u):
    """The unit vector orthogonal to the unit vector u that is nearest to the direction of b (any for parallel b)."""
    along = dot(b, u)
    r = (b[0] - along * u[0], b[1] - along * u[1], b[2] - along * u[2])
    square = dot(r, r)
    if not square > 1e-200 or square < 1e-8 * along * along:
        # b is zero or parallel to u to round-off: use the axis along which u is smallest.
        if abs(u[0]) <= abs(u[1]) and abs(u[0]) <= abs(u[2]):
            r = (1.0 - u[0] * u[0], -u[0] * u[1], -u[0] * u[2])
        elif abs(u[1]) <= abs(u[2]):
            r = (-u[1] * u[0], 1.0 - u[1] * u[1], -u[1] * u[2])
        else:
            r = (-u[2] * u[0], -u[2] * u[1], 1.0 - u[2] * u[2])
        square = dot(r, r)
    size = math.sqrt(square)
    r = (r[0] / size, r[1] / size, r[2] / size)
    along = dot(r, u)
    r = (r[0] - along * u[0], r[1] - along * u[1], r[2] - along * u[2])
    size = math.sqrt(dot(r, r))
    return (r[0] / size, r[1] / size, r[2] / size)


@njit(cache=True)
def _svd_batch(F, U, s, V):
    for e in range(len(F)):
        u, stretches, v = svd3(load_mat(F, e))
        store_mat(u, U, e)
        store_mat(v, V, e)
        s[e, 0] = stretches[0]
        s[e, 1] = stretches[1]
        s[e, 2] = stretches[2]


@njit(cache=True)
def principal_stretches(F):
    """(m, 3) the singular values of `rotation_variant_svd` of F (m, 3, 3), without the rotations."""
    out = np.empty((len(F), 3))
    b = np.empty((9, _LANES))
    for first in range(0, len(F), _LANES):
        last = min(first + _LANES, len(F))
        for lane in range(_LANES):
            e = min(first + lane, last - 1)
            for j in range(3):
                b[j, lane], b[3 + j, lane], b[6 + j, lane] = F[e, j, 0], F[e, j, 1], F[e, j, 2]
        for _ in range(_MAX_SWEEPS):
            if not (_rotate_lanes(b, 0, 3) | _rotate_lanes(b, 0, 6) | _rotate_lanes(b, 3, 6)):
                break
        for e in range(first, last):
            lane, largest = e - first, 0.0
            for j in range(9):
                largest = max(largest, abs(F[e, j // 3, j % 3]))
            if largest > 1e-60 and largest < 1e60:
                b0, b1 = (b[0, lane], b[1, lane], b[2, lane]), (b[3, lane], b[4, lane], b[5, lane])
                b2 = (b[6, lane], b[7, lane], b[8, lane])
                n0, n1, n2 = math.sqrt(dot(b0, b0)), math.sqrt(dot(b1, b1)), math.sqrt(dot(b2, b2))
                smallest = min(n0, n1, n2)
                out[e, 0] = max(n0, n1, n2)
                out[e, 1] = max(min(n0, n1), min(max(n0, n1), n2))
                out[e, 2] = -smallest if dot(cross(b0, b1), b2) < 0.0 else smallest
            else:
                out[e, 0], out[e, 1], out[e, 2] = svd3(load_mat(F, e))[1]
    return out


@njit
def _rotate_lanes(b, p, q):
    """`_orthogonalize` in all columns of b: rows p and q begin the two vectors. Returns whether to sweep again.

    Without branches, this is vector code.
    """
    again = 0
    for lane in range(_LANES):
        p0, p1, p2 = b[p, lane], b[p + 1, lane], b[p + 2, lane]
        q0, q1, q2 = b[q, lane], b[q + 1, lane], b[q + 2, lane]
        app = p0 * p0 + p1 * p1 + p2 * p2
        aqq = q0 * q0 + q1 * q1 + q2 * q2
        apq = p0 * q0 + p1 * q1 + p2 * q2
        size, square = app * aqq, apq * apq
        d, h = aqq - app, 2.0 * apq
        t = h / (abs(d) + math.sqrt(d * d + h * h) + 1e-300)
        t = -t if d < 0.0 else t
        c = 1.0 / math.sqrt(1.0 + t * t)
        s = t * c
        b[p, lane], b[p + 1, lane], b[p + 2, lane] = c * p0 - s * q0, c * p1 - s * q1, c * p2 - s * q2
        b[q, lane], b[q + 1, lane], b[q + 2, lane] = s * p0 + c * q0, s * p1 + c * q1, s * p2 + c * q2
        large = (t * t >= _SMALL_ANGLE) | (square >= _SMALL_COSINE * size)
        again |= (square > _ORTHOGONAL * size) & large
    return again


def rotation_variant_svd(
    F: ArrayLike,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """F = U diag(s) V^T with rotations U and V; the last singular value has the sign of det F.

    Parameters
    ----------
    F : (..., 3, 3) finite numbers [-], of any rank and sign of determinant.

    Returns
    -------
    U, s, V : (..., 3, 3), (..., 3), (..., 3, 3) float64; det U = det V = +1, s[..., 0] >= s[..., 1] >= |s[..., 2]|.

    Raises
    ------
    SolverError : where the last two axes are not (3, 3).
    """
    F = np.asarray(F, dtype=np.float64)
    if F.shape[-2:] != (3, 3):
        raise SolverError(f"F has shape {F.shape}; its last two axes must be (3, 3)")
    flat = np.ascontiguousarray(F.reshape(-1, 3, 3))
    U, s, V = np.empty_like(flat), np.empty((len(flat), 3)), np.empty_like(flat)
    _svd_batch(flat, U, s, V)
    return U.reshape(F.shape), s.reshape(F.shape[:-1]), V.reshape(F.shape)
