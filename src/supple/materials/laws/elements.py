"""Gradients and Hessians of tets by their nodes, from stresses and Hessians by F.

With B = Dm^-1, whose rows are the shape gradients g_1, g_2, g_3 and g_0 = -(g_1 + g_2 + g_3): the gradient by node p is
V P g_p, and block (p, q) of the Hessian has the entries V sum_jl H_(ij)(kl) g_p,j g_q,l.
"""

from __future__ import annotations

import numpy as np

from supple.runtime.kernel_cache import njit, prange


@njit(parallel=True, cache=True)
def element_forces(P, B, volumes, out):
    """The gradients (k, 4, 3) by the nodes [N] of stresses P (k, 3, 3), with B (k, 3, 3) and volumes (k,)."""
    for e in prange(len(P)):
        for i in range(3):
            total = 0.0
            for p in range(3):
                force = volumes[e] * (P[e, i, 0] * B[e, p, 0] + P[e, i, 1] * B[e, p, 1] + P[e, i, 2] * B[e, p, 2])
                out[e, p + 1, i] = force
                total += force
            out[e, 0, i] = -total


@njit(parallel=True, cache=True)
def element_stiffness(H, B, volumes, out):
    """The Hessians (k, 12, 12) by the nodes [N/m] of Hessians H (k, 9, 9) by F."""
    for e in prange(len(H)):
        half = np.empty((9, 9))  # (3 i + j, 3 q + k): contracted with g_q
        for a in range(9):
            for q in range(3):
                for k in range(3):
                    half[a, 3 * q + k] = volumes[e] * (
                        H[e, a, 3 * k] * B[e, q, 0] + H[e, a, 3 * k + 1] * B[e, q, 1] + H[e, a, 3 * k + 2] * B[e, q, 2]
                    )
        for p in range(3):
            for i in range(3):
                row = 3 * p + i
                for column in range(row + 1):
                    value = (
                        B[e, p, 0] * half[3 * i, column]
                        + B[e, p, 1] * half[3 * i + 1, column]
                        + B[e, p, 2] * half[3 * i + 2, column]
                    )
                    out[e, 3 + row, 3 + column] = value
                    out[e, 3 + column, 3 + row] = value
        # Shape gradients sum to zero, so the blocks of every row do: a translation has exactly zero energy.
        for row in range(9):
            for k in range(3):
                value = -(out[e, 3 + row, 3 + k] + out[e, 3 + row, 6 + k] + out[e, 3 + row, 9 + k])
                out[e, 3 + row, k] = value
                out[e, k, 3 + row] = value
        for i in range(3):
            for k in range(i + 1):
                value = -(out[e, 3 + i, k] + out[e, 6 + i, k] + out[e, 9 + i, k])
                out[e, i, k] = value
                out[e, k, i] = value
