"""Preconditioned conjugate gradients on 3x3-block matrices, in few passes over memory.

Sums are taken group by group and then over groups in order: the same bits on any number of threads. The inner product
r.z needs the coarse part of z only through its coarse coefficients, so that an iteration is three passes: the product
with the matrix; the update of x and r with the smoother and the restriction; the prolongation with the next direction.

Source: Saad, "Iterative Methods for Sparse Linear Systems" (2003), algorithm 9.1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.numerics.kernel_cache import njit, prange
from supple.numerics.sparse.preconditioner import TwoLevel
from supple.numerics.sparse.skyline_cholesky import solve
from supple.numerics.threads import threads_for

# Three short passes in each iteration: fewer blocks than this are worked on by one thread.
_SERIAL_BLOCKS = 50_000

NOTHING_MORE = np.zeros((0, 0, 3))


@dataclass(frozen=True)
class CGResult:
    """How a solve went.

    Attributes
    ----------
    iterations : products with the matrix; converged : whether the tolerance was met
    indefinite : whether a direction of no positive curvature was met, which ends the search
    first_norm : of the residual at the start, sqrt(r . M^-1 r)
    """

    iterations: int
    converged: bool
    indefinite: bool
    first_norm: float


def conjugate_gradients(
    data: NDArray[np.float64],
    preconditioner: TwoLevel,
    b: NDArray[np.float64],
    x: NDArray[np.float64],
    tolerance: float,
    max_iterations: int,
    low_rank: NDArray[np.float64] = NOTHING_MORE,
) -> CGResult:
    """Solve (A + sum g g^T) x = b.

    Parameters
    ----------
    data : (blocks, 3, 3) of A on `preconditioner.pattern`
    b : (n, 3); x : (n, 3) overwritten, the search starts at zero
    tolerance : on the residual's norm sqrt(r . M^-1 r), relative to that of b
    max_iterations : stop there, converged or not
    low_rank : (k, n, 3) the vectors g. The preconditioner becomes the inverse of M + sum g g^T, so that k costs no
        iterations
    """
    p = preconditioner.pattern
    with threads_for(p.blocks, _SERIAL_BLOCKS):
        iterations, converged, indefinite, first = _solve(
            p.row_start,
            p.columns,
            p.diagonal,
            data,
            preconditioner.group_start,
            preconditioner.inner,
            preconditioner.fields,
            preconditioner.first,
            preconditioner.inverse_diagonal,
            preconditioner.coarse,
            b,
            x,
            tolerance,
            max_iterations,
            low_rank,
        )
    return CGResult(int(iterations), bool(converged), bool(indefinite), float(first))


@njit(cache=True, parallel=True, error_model="numpy")
def _product(group_start, row_start, columns, data, p, Ap, sums):
    """Ap <- A p, and each group's share of p . Ap."""
    for g in prange(len(group_start) - 1):
        total = 0.0
        for i in range(group_start[g], group_start[g + 1]):
            a = b = c = 0.0
            for q in range(row_start[i], row_start[i + 1]):
                j = columns[q]
                x, y, z = p[j, 0], p[j, 1], p[j, 2]
                a += data[q, 0, 0] * x + data[q, 0, 1] * y + data[q, 0, 2] * z
                b += data[q, 1, 0] * x + data[q, 1, 1] * y + data[q, 1, 2] * z
                c += data[q, 2, 0] * x + data[q, 2, 1] * y + data[q, 2, 2] * z
            Ap[i, 0], Ap[i, 1], Ap[i, 2] = a, b, c
            total += p[i, 0] * a + p[i, 1] * b + p[i, 2] * c
        sums[g] = total


@njit(cache=True, parallel=True, error_model="numpy")
def _smooth(alpha, group_start, columns, diagonal, inner, data, inverse, fields, p, Ap, x, r, z, restricted, sums):
    """x += alpha p, r -= alpha Ap, z <- S^-1 r, restricted <- Z^T r, and each group's share of r . z."""
    for g in prange(len(group_start) - 1):
        low, high = group_start[g], group_start[g + 1]
        for i in range(low, high):
            for k in range(3):
                x[i, k] += alpha * p[i, k]
                r[i, k] -= alpha * Ap[i, k]
        for k in range(12):
            restricted[12 * g + k] = 0.0
        for i in range(low, high):
            a, b, c = r[i, 0], r[i, 1], r[i, 2]
            for m in range(4):
                w = fields[i, m]
                restricted[12 * g + 3 * m] += w * a
                restricted[12 * g + 3 * m + 1] += w * b
                restricted[12 * g + 3 * m + 2] += w * c
            for q in range(inner[i, 0], diagonal[i]):
                j = columns[q]
                u, v, w = z[j, 0], z[j, 1], z[j, 2]
                a -= data[q, 0, 0] * u + data[q, 0, 1] * v + data[q, 0, 2] * w
                b -= data[q, 1, 0] * u + data[q, 1, 1] * v + data[q, 1, 2] * w
                c -= data[q, 2, 0] * u + data[q, 2, 1] * v + data[q, 2, 2] * w
            z[i, 0] = inverse[i, 0, 0] * a + inverse[i, 0, 1] * b + inverse[i, 0, 2] * c
            z[i, 1] = inverse[i, 1, 0] * a + inverse[i, 1, 1] * b + inverse[i, 1, 2] * c
            z[i, 2] = inverse[i, 2, 0] * a + inverse[i, 2, 1] * b + inverse[i, 2, 2] * c
        total = 0.0
        for i in range(high - 1, low - 1, -1):
            a = b = c = 0.0
            for q in range(diagonal[i] + 1, inner[i, 1]):
                j = columns[q]
                u, v, w = z[j, 0], z[j, 1], z[j, 2]
                a += data[q, 0, 0] * u + data[q, 0, 1] * v + data[q, 0, 2] * w
                b += data[q, 1, 0] * u + data[q, 1, 1] * v + data[q, 1, 2] * w
                c += data[q, 2, 0] * u + data[q, 2, 1] * v + data[q, 2, 2] * w
            z[i, 0] -= inverse[i, 0, 0] * a + inverse[i, 0, 1] * b + inverse[i, 0, 2] * c
            z[i, 1] -= inverse[i, 1, 0] * a + inverse[i, 1, 1] * b + inverse[i, 1, 2] * c
            z[i, 2] -= inverse[i, 2, 0] * a + inverse[i, 2, 1] * b + inverse[i, 2, 2] * c
            total += r[i, 0] * z[i, 0] + r[i, 1] * z[i, 1] + r[i, 2] * z[i, 2]
        sums[g] = total


@njit(cache=True, parallel=True, error_model="numpy")
def _direction(beta, group_start, fields, coefficients, z, p):
    """p <- z + Z coefficients + beta p."""
    for g in prange(len(group_start) - 1):
        for i in range(group_start[g], group_start[g + 1]):
            for k in range(3):
                value = z[i, k]
                for m in range(4):
                    value += fields[i, m] * coefficients[12 * g + 3 * m + k]
                p[i, k] = value + beta * p[i, k]


@njit(cache=True, error_model="numpy")
def _inner(a, b):
    total = 0.0
    for i in range(len(a)):
        total += a[i, 0] * b[i, 0] + a[i, 1] * b[i, 1] + a[i, 2] * b[i, 2]
    return total


@njit(cache=True, error_model="numpy")
def _add(factor, a, out):
    for i in range(len(a)):
        for k in range(3):
            out[i, k] += factor * a[i, k]


@njit(cache=True, error_model="numpy")
def _inverse(a):
    """Of a small positive definite matrix, by elimination."""
    n = len(a)
    out = np.eye(n)
    for k in range(n):
        pivot = a[k, k]
        for j in range(n):
            a[k, j] /= pivot
            out[k, j] /= pivot
        for i in range(n):
            if i != k:
                factor = a[i, k]
                for j in range(n):
                    a[i, j] -= factor * a[k, j]
                    out[i, j] -= factor * out[k, j]
    return out


@njit(cache=True, error_model="numpy")
def _solve(
    row_start,
    columns,
    diagonal,
    data,
    group_start,
    inner,
    fields,
    first,
    inverse,
    coarse,
    rhs,
    x,
    tolerance,
    max_iterations,
    low,
):
    groups = len(group_start) - 1
    sums = np.zeros(groups)
    restricted = np.zeros(12 * groups)
    coefficients = np.zeros(12 * groups)
    r = np.zeros_like(rhs)
    for i in range(len(rhs)):
        for k in range(3):
            x[i, k] = 0.0
    z = np.zeros_like(r)
    p = np.zeros_like(r)
    Ap = np.zeros_like(r)
    alpha = 0.0
    # (M + G G^T)^-1 = M^-1 - Y S^-1 Y^T with Y = M^-1 G and S = 1 + G^T Y.
    Y = np.zeros_like(low)
    S = np.eye(len(low))
    for m in range(len(low)):
        _add(1.0, low[m], r)
        _smooth(alpha, group_start, columns, diagonal, inner, data, inverse, fields, p, Ap, x, r, z, restricted, sums)
        for k in range(12 * groups):
            coefficients[k] = restricted[k]
        solve(coarse, first, coefficients)
        _direction(0.0, group_start, fields, coefficients, z, Y[m])
        _add(-1.0, low[m], r)
        for n in range(len(low)):
            S[n, m] += _inner(low[n], Y[m])
    S_inverse = _inverse(S)
    weights = np.zeros(len(low))
    _add(1.0, rhs, r)
    first_norm = 0.0
    old = 0.0
    for iteration in range(max_iterations + 1):
        _smooth(alpha, group_start, columns, diagonal, inner, data, inverse, fields, p, Ap, x, r, z, restricted, sums)
        for k in range(12 * groups):
            coefficients[k] = restricted[k]
        solve(coarse, first, coefficients)
        rz = 0.0
        for g in range(groups):
            rz += sums[g]
        for k in range(12 * groups):
            rz += restricted[k] * coefficients[k]
        for m in range(len(low)):
            weights[m] = _inner(Y[m], r)
        for m in range(len(low)):
            for n in range(len(low)):
                rz -= weights[m] * S_inverse[m, n] * weights[n]
        norm = rz**0.5 if rz > 0.0 else 0.0
        if iteration == 0:
            first_norm = norm
        if norm <= tolerance * first_norm:
            return iteration, rz >= 0.0, not rz >= 0.0, first_norm
        if iteration == max_iterations or not rz < np.inf:
            break
        beta = rz / old if iteration > 0 else 0.0
        old = rz
        _direction(beta, group_start, fields, coefficients, z, p)
        for m in range(len(low)):
            total = 0.0
            for n in range(len(low)):
                total += S_inverse[m, n] * weights[n]
            _add(-total, Y[m], p)
        _product(group_start, row_start, columns, data, p, Ap, sums)
        curvature = 0.0
        for g in range(groups):
            curvature += sums[g]
        for m in range(len(low)):
            along = _inner(low[m], p)
            _add(along, low[m], Ap)
            curvature += along * along
        if not curvature > 0.0:
            return iteration, False, True, first_norm
        alpha = rz / curvature
    return iteration, False, False, first_norm
