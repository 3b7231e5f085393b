"""Cholesky factorization of a small dense symmetric matrix of 12x12 blocks that is zero outside an envelope.

Plain loops in one fixed order, so that the result has the same bits on every number of threads, which a threaded LAPACK
does not promise.
"""

import numpy as np

from supple.runtime.kernel_cache import njit, prange

SIZE = 12

# A pivot that lost this much of its diagonal entry to cancellation belongs to a direction that other unknowns span
# already.
_DEPENDENT = 1e-11


@njit
def _factor_diagonal(block, diagonal):
    """Cholesky factor of a 12x12 block in place, its diagonal inverted; dependent directions get the inverse 0."""
    for c in range(SIZE):
        pivot = block[c, c]
        for k in range(c):
            pivot -= block[c, k] * block[c, k]
        inverse = 1.0 / pivot**0.5 if pivot > _DEPENDENT * diagonal[c] else 0.0
        block[c, c] = inverse
        for r in range(c + 1, SIZE):
            value = block[r, c]
            for k in range(c):
                value -= block[r, k] * block[c, k]
            block[r, c] = value * inverse
            block[c, r] = 0.0


@njit
def _solve_right(block, factor):
    """block <- block L^-T for a factored diagonal block L."""
    for r in range(SIZE):
        for c in range(SIZE):
            value = block[r, c]
            for k in range(c):
                value -= block[r, k] * factor[c, k]
            block[r, c] = value * factor[c, c]


@njit
def _subtract_product(target, left, right_transposed):
    for r in range(SIZE):
        for k in range(SIZE):
            value = left[r, k]
            for c in range(SIZE):
                target[r, c] -= value * right_transposed[k, c]


@njit(cache=True, parallel=True)
def factorize(matrix, first):
    """Factor in place: A = L L^T.

    Parameters
    ----------
    matrix : (b, b, 12, 12) blocks of A; on return the lower blocks hold L, the diagonals of diagonal blocks inverted,
        and the upper blocks (j, i), j < i, hold the transposes of L's blocks (i, j).
    first : (b,) int32 the first block column of each row's envelope
    """
    count = len(first)
    original = np.empty(SIZE)
    for k in range(count):
        diagonal = matrix[k, k]
        for c in range(SIZE):
            original[c] = diagonal[c, c]
        for j in range(first[k], k):
            _subtract_product(diagonal, matrix[k, j], matrix[j, k])
        _factor_diagonal(diagonal, original)
        for i in prange(k + 1, count):
            if first[i] <= k:
                block = matrix[i, k]
                for j in range(max(first[i], first[k]), k):
                    _subtract_product(block, matrix[i, j], matrix[j, k])
                _solve_right(block, diagonal)
                for r in range(SIZE):
                    for c in range(SIZE):
                        matrix[k, i, c, r] = block[r, c]


@njit(cache=True, fastmath={"reassoc", "contract"})
def solve(factor, first, b):
    """b <- A^-1 b for a factored matrix; b : (12 n,).

    Both passes read the lower blocks, which are next to each other in memory; the second one finds most in the cache.
    """
    count = len(first)
    for i in range(count):
        o = SIZE * i
        for j in range(first[i], i):
            p = SIZE * j
            for r in range(SIZE):
                value = 0.0
                for c in range(SIZE):
                    value += factor[i, j, r, c] * b[p + c]
                b[o + r] -= value
        for r in range(SIZE):
            value = b[o + r]
            for c in range(r):
                value -= factor[i, i, r, c] * b[o + c]
            b[o + r] = value * factor[i, i, r, r]
    for i in range(count - 1, -1, -1):
        o = SIZE * i
        for r in range(SIZE - 1, -1, -1):
            value = b[o + r]
            for c in range(r + 1, SIZE):
                value -= factor[i, i, c, r] * b[o + c]
            b[o + r] = value * factor[i, i, r, r]
        for j in range(first[i], i):
            p = SIZE * j
            for r in range(SIZE):
                value = b[o + r]
                for c in range(SIZE):
                    b[p + c] -= factor[i, j, r, c] * value
