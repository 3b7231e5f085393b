"""Preconditioned conjugate gradients on 3x3-block matrices, in few passes over memory.

Sums are taken group by group and then over groups in order: the same bits on any number of threads. The inner product
r.z needs the coarse part of z only through its coarse coefficients. An iteration reads the matrix once: half of it in
the sweep backward, the other half in the sweep forward, which also give the product (`gauss_seidel`).

Source: Saad, "Iterative Methods for Sparse Linear Systems" (2003), algorithm 9.1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.numerics.mat3 import copy_elements
from supple.numerics.sparse.gauss_seidel import backward, forward, update
from supple.numerics.sparse.preconditioner import TwoLevel
from supple.numerics.sparse.skyline_cholesky import solve
from supple.runtime.kernel_cache import njit

# Blocks of half a matrix: the passes of an iteration over fewer are too short to be shared by threads.
_SHARED_FROM = 10_000

NOTHING_MORE, _NO_MATRIX = np.zeros((0, 0, 3)), np.zeros((0, 0))


Product = Callable[[NDArray[np.float64]], NDArray[np.float64]]


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
    preconditioner : updated with the matrix A
    b : (n, 3); x : (n, 3) overwritten, the search starts at zero
    tolerance : on the residual's norm sqrt(r . M^-1 r), relative to that of b
    max_iterations : stop there, converged or not
    low_rank : (k, n, 3) the vectors g. The preconditioner becomes the inverse of M + sum g g^T, so that k costs no
        iterations
    """
    order = preconditioner.order
    solution = np.zeros_like(x)
    inverse = _inverse(preconditioner)
    more = (low_rank, low_rank, low_rank, low_rank, _NO_MATRIX)
    if len(low_rank):
        low = np.take(low_rank, order.rows, axis=1)
        more = (low, np.zeros_like(low), np.zeros_like(low), np.zeros_like(low), np.eye(len(low)))
        _prepare(*inverse, *more)
    rhs = b[order.rows]
    iterations, converged, indefinite, first = _solve(*inverse, rhs, solution, tolerance, max_iterations, more)
    x[order.rows] = solution
    return CGResult(int(iterations), bool(converged), bool(indefinite), float(first))


def gradients_by_products(
    product: Product, inverse: Product, b: NDArray[np.float64], tolerance: float, max_iterations: int
) -> tuple[NDArray[np.float64], CGResult]:
    """Solve A x = b for a matrix that is known by its products, with the products of a preconditioner."""
    x, r, p = np.zeros_like(b), b.copy(), inverse(b)
    rho = float(np.vdot(b, p))
    first = rho**0.5 if rho > 0.0 else 0.0
    for iteration in range(max_iterations + 1):
        if not 0.0 <= rho < np.inf or rho <= (tolerance * first) ** 2:
            return x, CGResult(iteration, 0.0 <= rho < np.inf, rho < 0.0, first)
        if iteration == max_iterations:
            break
        Ap = product(p)
        curvature = float(np.vdot(p, Ap))
        if not curvature > 0.0:
            return x, CGResult(iteration, False, True, first)
        x += rho / curvature * p
        r -= rho / curvature * Ap
        z = inverse(r)
        rho, before = float(np.vdot(r, z)), rho
        p = z + rho / before * p
    return x, CGResult(max_iterations, False, False, first)


def preconditioned(preconditioner: TwoLevel, r: NDArray[np.float64]) -> NDArray[np.float64]:
    """M^-1 r, (n, 3)."""
    rows, out = preconditioner.order.rows, np.empty_like(r)
    low = r[None, rows]
    solution = np.zeros_like(low)
    _prepare(*_inverse(preconditioner), low, np.zeros_like(low), solution, np.zeros_like(low), np.eye(1))
    out[rows] = solution[0]
    return out


def _inverse(preconditioner: TwoLevel) -> tuple[Any, ...]:
    """What kernels take of a preconditioner."""
    order = preconditioner.order
    return (
        (order.color_start, order.group_start, order.cluster_start, order.dense_start),
        (order.lower.start, order.lower.columns, order.lower.blocks),
        (order.upper.start, order.upper.columns, order.upper.blocks),
        preconditioner.diagonal,
        preconditioner.inverse_diagonal,
        (preconditioner.coarse_of, preconditioner.places, preconditioner.group_start, preconditioner.fields),
        preconditioner.first,
        preconditioner.coarse,
    )


@njit
def _inner(a, b):
    total = 0.0
    for i in range(len(a)):
        total += a[i, 0] * b[i, 0] + a[i, 1] * b[i, 1] + a[i, 2] * b[i, 2]
    return total


@njit
def _add(factor, a, out):
    for i in range(len(a)):
        for k in range(3):
            out[i, k] += factor * a[i, k]


@njit
def _invert(a, out):
    """The inverse of a small positive definite matrix, by elimination, which destroys it; `out` begins as 1."""
    n = len(a)
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


@njit
def _coarse_solution(restricted, coarse, first, coefficients):
    for k in range(len(restricted)):
        coefficients[k] = restricted[k]
    solve(coarse, first, coefficients)


@njit(cache=True, rows=_SHARED_FROM)
def _prepare(clusters, lower, upper, diagonal, inverse, coarse_groups, first, coarse, low, W, Y, UY, S_inverse):
    """(M + G G^T)^-1 = M^-1 - Y S^-1 Y^T with Y = M^-1 G and S = 1 + G^T Y. W = (D + L)^-1 G."""
    sums = np.zeros(len(clusters[1]) - 1)
    restricted = np.zeros(12 * len(first))
    coefficients = np.zeros(len(restricted))
    r, s, t, p = np.zeros_like(low[0]), np.zeros_like(low[0]), np.zeros_like(low[0]), np.zeros_like(low[0])
    Up, Ap, x = np.zeros_like(low[0]), np.zeros_like(low[0]), np.zeros_like(low[0])
    S = S_inverse.copy()
    for m in range(len(low)):
        # With p = 0 the sweep forward takes its right side from Ut: Ap becomes g and w becomes (D + L)^-1 g.
        forward(0.0, clusters, lower, diagonal, inverse, t, low[m], p, Up, Ap, W[m], sums)
        copy_elements(low[m], r)
        update(0.0, coarse_groups, p, Ap, W[m], x, r, s, restricted)
        _coarse_solution(restricted, coarse, first, coefficients)
        backward(clusters, upper, inverse, coarse_groups, coefficients, r, W[m], s, Y[m], UY[m], sums)
        for n in range(len(low)):
            S[n, m] += _inner(low[n], Y[m])
    _invert(S, S_inverse)


@njit(cache=True, rows=_SHARED_FROM)
def _solve(
    clusters, lower, upper, diagonal, inverse, coarse_groups, first, coarse, rhs, x, tolerance, max_iterations, more
):
    low, W, Y, UY, S_inverse = more
    sums = np.zeros(len(clusters[1]) - 1)
    restricted = np.zeros(12 * len(first))
    coefficients = np.zeros(len(restricted))
    r, y, s, t, Ut = np.zeros_like(rhs), np.zeros_like(rhs), np.zeros_like(rhs), np.zeros_like(rhs), rhs
    p, Up, Ap, w = np.zeros_like(rhs), np.zeros_like(rhs), np.zeros_like(rhs), np.zeros_like(rhs)
    weights = np.zeros(len(low))
    first_norm = old = rz = beta = 0.0
    for iteration in range(max_iterations + 1):
        forward(beta, clusters, lower, diagonal, inverse, t, Ut, p, Up, Ap, w, sums)
        # At first p is zero and Ap the right side, of which this update makes r.
        alpha = -1.0
        if iteration > 0:
            curvature = 0.0
            for g in range(len(sums)):
                curvature += sums[g]
            for m in range(len(low)):
                along = _inner(low[m], p)
                _add(along, low[m], Ap)
                _add(along, W[m], w)
                curvature += along * along
            if not curvature > 0.0:
                return iteration - 1, False, True, first_norm
            alpha = rz / curvature
        update(alpha, coarse_groups, p, Ap, w, x, r, y, restricted)
        _coarse_solution(restricted, coarse, first, coefficients)
        backward(clusters, upper, inverse, coarse_groups, coefficients, r, y, s, t, Ut, sums)
        rz = 0.0
        for g in range(len(sums)):
            rz += sums[g]
        for k in range(len(restricted)):
            rz += restricted[k] * coefficients[k]
        for m in range(len(low)):
            weights[m] = _inner(Y[m], r)
        for m in range(len(low)):
            total = 0.0
            for n in range(len(low)):
                total += S_inverse[m, n] * weights[n]
            rz -= weights[m] * total
            _add(-total, Y[m], t)
            _add(-total, UY[m], Ut)
        norm = rz**0.5 if rz > 0.0 else 0.0
        if iteration == 0:
            first_norm = norm
        if norm <= tolerance * first_norm:
            return iteration, rz >= 0.0, not rz >= 0.0, first_norm
        if iteration == max_iterations or not rz < np.inf:
            break
        beta = rz / old if iteration > 0 else 0.0
        old = rz
    return iteration, False, False, first_norm
