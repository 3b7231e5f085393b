"""Symmetric Gauss-Seidel and products with the matrix, both in one reading of its blocks.

With A = L + E + U, where E has the blocks within clusters of rows, and S = (D + L) D^-1 (D + U), where D is E, or what
stands in for it where E is not definite: the sweep backward gives s = S^-1 r from y = (D + L)^-1 r and also U t, the
sweep forward A p and also w = (D + L)^-1 A p, by which y changes. Each block beside E is read once in an iteration of
conjugate gradients, for two products.

Source: Eisenstat, "Efficient Implementation of a Class of Preconditioned Conjugate Gradient Methods" (1981).
"""

import numpy as np

from supple.numerics.sparse.clusters import MOST_ROWS
from supple.runtime.kernel_cache import njit, prange

_MOST = 3 * MOST_ROWS


@njit
def _update_group(g, alpha, places, start, fields, p, Ap, w, x, r, y, restricted):
    total = np.zeros(12)
    for k in range(start[g], start[g + 1]):
        i = places[k]
        for c in range(3):
            x[i, c] += alpha * p[i, c]
            r[i, c] -= alpha * Ap[i, c]
            y[i, c] -= alpha * w[i, c]
        for m in range(4):
            for c in range(3):
                total[3 * m + c] += fields[i, m] * r[i, c]
    for m in range(12):
        restricted[12 * g + m] = total[m]


@njit(parallel=True)
def update(alpha, coarse_groups, p, Ap, w, x, r, y, restricted):
    """x += alpha p, r -= alpha Ap, y -= alpha w, restricted <- Z^T r."""
    _, places, start, fields = coarse_groups
    for g in prange(len(start) - 1):
        _update_group(g, alpha, places, start, fields, p, Ap, w, x, r, y, restricted)


@njit(forceinline=True)
def _two_products(begin, end, columns, blocks, one, other):
    """A row of blocks by two vectors (n, 3)."""
    a = b = c = d = e = f = 0.0
    for q in range(begin, end):
        j = columns[q]
        u, v, w = one[j, 0], one[j, 1], one[j, 2]
        a += blocks[q, 0, 0] * u + blocks[q, 0, 1] * v + blocks[q, 0, 2] * w
        b += blocks[q, 1, 0] * u + blocks[q, 1, 1] * v + blocks[q, 1, 2] * w
        c += blocks[q, 2, 0] * u + blocks[q, 2, 1] * v + blocks[q, 2, 2] * w
        u, v, w = other[j, 0], other[j, 1], other[j, 2]
        d += blocks[q, 0, 0] * u + blocks[q, 0, 1] * v + blocks[q, 0, 2] * w
        e += blocks[q, 1, 0] * u + blocks[q, 1, 1] * v + blocks[q, 1, 2] * w
        f += blocks[q, 2, 0] * u + blocks[q, 2, 1] * v + blocks[q, 2, 2] * w
    return a, b, c, d, e, f


@njit(forceinline=True)
def _block_product(matrix, o, u, v, w):
    """The 3x3 matrix from `matrix[o]` on by a vector."""
    return (
        matrix[o] * u + matrix[o + 1] * v + matrix[o + 2] * w,
        matrix[o + 3] * u + matrix[o + 4] * v + matrix[o + 5] * w,
        matrix[o + 6] * u + matrix[o + 7] * v + matrix[o + 8] * w,
    )


@njit
def _add_dense(matrix, factor, v, out):
    """out (n,) += factor M v for the symmetric M from the first of `matrix` on."""
    n = len(out)
    for c in range(n):
        value = factor * v[c]
        row = matrix[n * c : n * c + n]
        for r in range(n):
            out[r] += row[r] * value


@njit
def _backward_group(k, clusters, upper, inverse, coarse_groups, coefficients, r, y, s, t, Ut, sums):
    _, start, cluster_start, dense_start = clusters
    row_start, columns, blocks = upper
    coarse_of, _, _, fields = coarse_groups
    n = len(r)
    above, solved = np.empty(_MOST), np.empty(_MOST)
    total = 0.0
    for cluster in range(start[k + 1] - 1, start[k] - 1, -1):
        begin, end = cluster_start[cluster], cluster_start[cluster + 1]
        for i in range(end - 1, begin - 1, -1):
            a, b, c, d, e, f = _two_products(row_start[n - 1 - i], row_start[n - i], columns, blocks, s, t)
            Ut[i, 0], Ut[i, 1], Ut[i, 2] = d, e, f
            if end - begin > 1:
                o = 3 * (i - begin)
                above[o], above[o + 1], above[o + 2] = a, b, c
                solved[o], solved[o + 1], solved[o + 2] = y[i, 0], y[i, 1], y[i, 2]
            else:
                a, b, c = _block_product(inverse, dense_start[cluster], a, b, c)
                s[i, 0], s[i, 1], s[i, 2] = y[i, 0] - a, y[i, 1] - b, y[i, 2] - c
        if end - begin > 1:
            _add_dense(inverse[dense_start[cluster] :], -1.0, above, solved[: 3 * (end - begin)])
            for i in range(begin, end):
                for m in range(3):
                    s[i, m] = solved[3 * (i - begin) + m]
        for i in range(begin, end):
            g = 12 * coarse_of[i]
            for m in range(3):
                value = s[i, m]
                total += r[i, m] * value
                for o in range(4):
                    value += fields[i, o] * coefficients[g + 3 * o + m]
                t[i, m] = value
    sums[k] = total


@njit(parallel=True)
def backward(clusters, upper, inverse, coarse_groups, coefficients, r, y, s, t, Ut, sums):
    """s <- S^-1 r with y = (D + L)^-1 r, t <- s + Z coefficients, Ut <- U t, and each group's share of r . s."""
    colors = clusters[0]
    for c in range(len(colors) - 2, -1, -1):
        for k in prange(colors[c], colors[c + 1]):
            _backward_group(k, clusters, upper, inverse, coarse_groups, coefficients, r, y, s, t, Ut, sums)


@njit
def _forward_group(k, beta, clusters, lower, diagonal, inverse, t, Ut, p, Up, Ap, w, sums):
    _, start, cluster_start, dense_start = clusters
    row_start, columns, blocks = lower
    before, product, direction, solved = np.empty(_MOST), np.empty(_MOST), np.empty(_MOST), np.empty(_MOST)
    total = 0.0
    for cluster in range(start[k], start[k + 1]):
        begin, end = cluster_start[cluster], cluster_start[cluster + 1]
        for i in range(begin, end):
            a, b, c, d, e, f = _two_products(row_start[i], row_start[i + 1], columns, blocks, p, w)
            for m in range(3):
                p[i, m] = t[i, m] + beta * p[i, m]
                Up[i, m] = Ut[i, m] + beta * Up[i, m]
            a, b, c = a + Up[i, 0], b + Up[i, 1], c + Up[i, 2]
            if end - begin > 1:
                o = 3 * (i - begin)
                for m in range(3):
                    direction[o + m] = p[i, m]
                    solved[o + m] = 0.0
                product[o], product[o + 1], product[o + 2] = a, b, c
                before[o], before[o + 1], before[o + 2] = d, e, f
            else:
                o = dense_start[cluster]
                u, v, h = _block_product(diagonal, o, p[i, 0], p[i, 1], p[i, 2])
                a, b, c = a + u, b + v, c + h
                Ap[i, 0], Ap[i, 1], Ap[i, 2] = a, b, c
                total += p[i, 0] * a + p[i, 1] * b + p[i, 2] * c
                w[i, 0], w[i, 1], w[i, 2] = _block_product(inverse, o, a - d, b - e, c - f)
        if end - begin == 1:
            continue
        n, o = 3 * (end - begin), dense_start[cluster]
        _add_dense(diagonal[o:], 1.0, direction, product[:n])
        for m in range(n):
            total += direction[m] * product[m]
            before[m] = product[m] - before[m]
        _add_dense(inverse[o:], 1.0, before, solved[:n])
        for i in range(begin, end):
            for m in range(3):
                Ap[i, m], w[i, m] = product[3 * (i - begin) + m], solved[3 * (i - begin) + m]
    sums[k] = total


@njit(parallel=True)
def forward(beta, clusters, lower, diagonal, inverse, t, Ut, p, Up, Ap, w, sums):
    """p <- t + beta p and Up <- Ut + beta Up; Ap, w <- (D + L)^-1 A p, and each group's share of p . Ap."""
    colors = clusters[0]
    for c in range(len(colors) - 1):
        for k in prange(colors[c], colors[c + 1]):
            _forward_group(k, beta, clusters, lower, diagonal, inverse, t, Ut, p, Up, Ap, w, sums)
