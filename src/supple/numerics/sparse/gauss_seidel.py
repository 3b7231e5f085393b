"""Symmetric Gauss-Seidel and products with the matrix, both in one reading of its blocks.

With A = L + E + U and S = (D + L) D^-1 (D + U), where D is E, or what stands in for it where E is not definite: the
sweep backward gives s = S^-1 r from y = (D + L)^-1 r and also U t, the sweep forward A p and also w = (D + L)^-1 A p,
by which y changes. Each block is read once in an iteration of conjugate gradients, for two products.

Source: Eisenstat, "Efficient Implementation of a Class of Preconditioned Conjugate Gradient Methods" (1981).
"""

import numpy as np

from supple.runtime.kernel_cache import njit, prange


@njit
def _update_group(k, alpha, groups, start, fields, p, Ap, w, x, r, y, restricted):
    g = 12 * groups[k]
    total = np.zeros(12)
    for i in range(start[k], start[k + 1]):
        for c in range(3):
            x[i, c] += alpha * p[i, c]
            r[i, c] -= alpha * Ap[i, c]
            y[i, c] -= alpha * w[i, c]
        for m in range(4):
            for c in range(3):
                total[3 * m + c] += fields[i, m] * r[i, c]
    for m in range(12):
        restricted[g + m] = total[m]


@njit(parallel=True)
def update(alpha, groups, start, fields, p, Ap, w, x, r, y, restricted):
    """x += alpha p, r -= alpha Ap, y -= alpha w, restricted <- Z^T r."""
    for k in prange(len(groups)):
        _update_group(k, alpha, groups, start, fields, p, Ap, w, x, r, y, restricted)


@njit
def _backward_group(k, groups, start, row_start, columns, blocks, inverse, fields, coefficients, r, y, s, t, Ut, sums):
    n = len(r)
    g = 12 * groups[k]
    total = 0.0
    for i in range(start[k + 1] - 1, start[k] - 1, -1):
        a = b = c = d = e = f = 0.0
        for q in range(row_start[n - 1 - i], row_start[n - i]):
            j = columns[q]
            u, v, w = s[j, 0], s[j, 1], s[j, 2]
            a += blocks[q, 0, 0] * u + blocks[q, 0, 1] * v + blocks[q, 0, 2] * w
            b += blocks[q, 1, 0] * u + blocks[q, 1, 1] * v + blocks[q, 1, 2] * w
            c += blocks[q, 2, 0] * u + blocks[q, 2, 1] * v + blocks[q, 2, 2] * w
            u, v, w = t[j, 0], t[j, 1], t[j, 2]
            d += blocks[q, 0, 0] * u + blocks[q, 0, 1] * v + blocks[q, 0, 2] * w
            e += blocks[q, 1, 0] * u + blocks[q, 1, 1] * v + blocks[q, 1, 2] * w
            f += blocks[q, 2, 0] * u + blocks[q, 2, 1] * v + blocks[q, 2, 2] * w
        Ut[i, 0], Ut[i, 1], Ut[i, 2] = d, e, f
        for m in range(3):
            value = y[i, m] - (inverse[i, m, 0] * a + inverse[i, m, 1] * b + inverse[i, m, 2] * c)
            total += r[i, m] * value
            s[i, m] = value
            for o in range(4):
                value += fields[i, o] * coefficients[g + 3 * o + m]
            t[i, m] = value
    sums[k] = total


@njit(parallel=True)
def backward(colors, groups, start, row_start, columns, blocks, inverse, fields, coefficients, r, y, s, t, Ut, sums):
    """s <- S^-1 r with y = (D + L)^-1 r, t <- s + Z coefficients, Ut <- U t, and each group's share of r . s."""
    for c in range(len(colors) - 2, -1, -1):
        for k in prange(colors[c], colors[c + 1]):
            _backward_group(
                k, groups, start, row_start, columns, blocks, inverse, fields, coefficients, r, y, s, t, Ut, sums
            )


@njit
def _forward_group(k, beta, start, row_start, columns, blocks, diagonal, inverse, t, Ut, p, Up, Ap, w, sums):
    total = 0.0
    for i in range(start[k], start[k + 1]):
        a = b = c = d = e = f = 0.0
        for q in range(row_start[i], row_start[i + 1]):
            j = columns[q]
            u, v, h = p[j, 0], p[j, 1], p[j, 2]
            a += blocks[q, 0, 0] * u + blocks[q, 0, 1] * v + blocks[q, 0, 2] * h
            b += blocks[q, 1, 0] * u + blocks[q, 1, 1] * v + blocks[q, 1, 2] * h
            c += blocks[q, 2, 0] * u + blocks[q, 2, 1] * v + blocks[q, 2, 2] * h
            u, v, h = w[j, 0], w[j, 1], w[j, 2]
            d += blocks[q, 0, 0] * u + blocks[q, 0, 1] * v + blocks[q, 0, 2] * h
            e += blocks[q, 1, 0] * u + blocks[q, 1, 1] * v + blocks[q, 1, 2] * h
            f += blocks[q, 2, 0] * u + blocks[q, 2, 1] * v + blocks[q, 2, 2] * h
        for m in range(3):
            p[i, m] = t[i, m] + beta * p[i, m]
            Up[i, m] = Ut[i, m] + beta * Up[i, m]
        u, v, h = p[i, 0], p[i, 1], p[i, 2]
        a += Up[i, 0] + diagonal[i, 0, 0] * u + diagonal[i, 0, 1] * v + diagonal[i, 0, 2] * h
        b += Up[i, 1] + diagonal[i, 1, 0] * u + diagonal[i, 1, 1] * v + diagonal[i, 1, 2] * h
        c += Up[i, 2] + diagonal[i, 2, 0] * u + diagonal[i, 2, 1] * v + diagonal[i, 2, 2] * h
        Ap[i, 0], Ap[i, 1], Ap[i, 2] = a, b, c
        total += u * a + v * b + h * c
        d, e, f = a - d, b - e, c - f
        for m in range(3):
            w[i, m] = inverse[i, m, 0] * d + inverse[i, m, 1] * e + inverse[i, m, 2] * f
    sums[k] = total


@njit(parallel=True)
def forward(colors, beta, start, row_start, columns, blocks, diagonal, inverse, t, Ut, p, Up, Ap, w, sums):
    """p <- t + beta p and Up <- Ut + beta Up; Ap, w <- (D + L)^-1 A p, and each group's share of p . Ap."""
    for c in range(len(colors) - 1):
        for k in prange(colors[c], colors[c + 1]):
            _forward_group(k, beta, start, row_start, columns, blocks, diagonal, inverse, t, Ut, p, Up, Ap, w, sums)
