"""The energies of edge patches, and their derivatives by the vertices of each patch."""

from __future__ import annotations

from typing import TYPE_CHECKING

from supple.materials.isotropic import is_kind, kernel_of_kinds
from supple.materials.laws.isotropic_law import principal_hessian_of
from supple.numerics.mat3 import load_mat, mat_mul_transposed, store_mat
from supple.numerics.svd3 import svd3 as decompose
from supple.runtime.kernel_cache import njit, prange

if TYPE_CHECKING:  # of each kind, see `functions_of`
    from supple.materials.isotropic import KIND, density, energy_density, principal_hessian, stress


# Numbers of a patch's frame: U (9), psi_ij (6), alpha (3) and beta (3) times its volume, see `isotropic`.
FRAME = 21


@njit
def _mean_gradient(x, start, vertices, gradients, k):
    """F of patch k, from differences to its first vertex: far from the origin they keep their accuracy."""
    begin = start[k]
    o = vertices[begin]
    a, b, c = x[o, 0], x[o, 1], x[o, 2]
    f0 = f1 = f2 = f3 = f4 = f5 = f6 = f7 = f8 = 0.0
    for s in range(begin + 1, start[k + 1]):
        v = vertices[s]
        p, q, r = x[v, 0] - a, x[v, 1] - b, x[v, 2] - c
        g, h, i = gradients[s, 0], gradients[s, 1], gradients[s, 2]
        f0 += p * g
        f1 += p * h
        f2 += p * i
        f3 += q * g
        f4 += q * h
        f5 += q * i
        f6 += r * g
        f7 += r * h
        f8 += r * i
    return (f0, f1, f2, f3, f4, f5, f6, f7, f8)


@kernel_of_kinds(parallel=True)
def edge_energies(x, start, vertices, gradients, volumes, kind, mu, lam, out):
    """Energy of every patch [J] into out (k,)."""
    for k in prange(len(volumes)):
        if is_kind(kind[k], KIND):
            F = _mean_gradient(x, start, vertices, gradients, k)
            out[k] = volumes[k] * energy_density(F, mu[k], lam[k])


@kernel_of_kinds(parallel=True)
def edge_models(
    x, start, vertices, gradients, volumes, kind, mu, lam, second, project, energies, forces, frames, turned
):
    """Energies (k,), gradients by the slots (s, 3) and, with `second`, what `pair_blocks` needs: the frames (k, 21) of
    the patches and the slots' gradients V^T g (s, 3)."""
    for k in prange(len(volumes)):
        if not is_kind(kind[k], KIND):
            continue
        F = _mean_gradient(x, start, vertices, gradients, k)
        U, s, V = decompose(F)
        v = volumes[k]
        energies[k] = v * density(F, s, mu[k], lam[k])
        P = stress(U, s, V, mu[k], lam[k])
        for t in range(start[k], start[k + 1]):
            g, h, i = gradients[t, 0], gradients[t, 1], gradients[t, 2]
            forces[t, 0] = v * (P[0] * g + P[1] * h + P[2] * i)
            forces[t, 1] = v * (P[3] * g + P[4] * h + P[5] * i)
            forces[t, 2] = v * (P[6] * g + P[7] * h + P[8] * i)
            if second:
                turned[t, 0] = V[0] * g + V[3] * h + V[6] * i
                turned[t, 1] = V[1] * g + V[4] * h + V[7] * i
                turned[t, 2] = V[2] * g + V[5] * h + V[8] * i
        if second:
            A, alpha, beta = principal_hessian(s, mu[k], lam[k], project)
            for c in range(9):
                frames[k, c] = U[c]
            for c in range(6):
                frames[k, 9 + c] = v * A[c]
            for c in range(3):
                frames[k, 15 + c] = v * alpha[c]
                frames[k, 18 + c] = v * beta[c]


@njit(cache=True, parallel=True)
def mean_gradients(x, start, vertices, gradients, rows, out):
    """F of the patches `rows` (r,) into out (r, 3, 3)."""
    for k in prange(len(rows)):
        store_mat(_mean_gradient(x, start, vertices, gradients, rows[k]), out, k)


@njit(cache=True, parallel=True)
def add_law_models(rows, start, gradients, volumes, U, V, values, second, project, energies, forces, frames):
    """Add what `edge_models` computes of the patches `rows` (r,), from the `values` (r, 16) of a law at their stretches
    and their U and V (r, 3, 3)."""
    for n in prange(len(rows)):
        k, u, x = rows[n], load_mat(U, n), values[n]
        v = volumes[k]
        energies[k] += v * x[0]
        scaled = (
            u[0] * x[1], u[1] * x[2], u[2] * x[3],
            u[3] * x[1], u[4] * x[2], u[5] * x[3],
            u[6] * x[1], u[7] * x[2], u[8] * x[3],
        )  # fmt: skip
        P = mat_mul_transposed(scaled, load_mat(V, n))
        for t in range(start[k], start[k + 1]):
            g, h, i = gradients[t, 0], gradients[t, 1], gradients[t, 2]
            forces[t, 0] += v * (P[0] * g + P[1] * h + P[2] * i)
            forces[t, 1] += v * (P[3] * g + P[4] * h + P[5] * i)
            forces[t, 2] += v * (P[6] * g + P[7] * h + P[8] * i)
        if second:
            A, alpha, beta = principal_hessian_of(x, project)
            for c in range(6):
                frames[k, 9 + c] += v * A[c]
            for c in range(3):
                frames[k, 15 + c] += v * alpha[c]
                frames[k, 18 + c] += v * beta[c]
