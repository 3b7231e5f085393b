"""The energies of edge patches and the volume energies of stars, their derivatives, and the blocks of their Hessian.

Of stars, with J_a the mean of J over a patch and v_e the volume of tet e,

    d (V_a l_a U(J_a)) = p_a sum_e dv_e,    p_a = l_a U'(J_a),
    d^2 (V_a l_a U(J_a)) = p_a sum_e d^2 v_e + (l_a U'' / V_a) (sum_e dv_e) (sum_e dv_e)^T.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from supple.materials.isotropic import hessian_block, is_kind, kernel_of_kinds, nearest_semidefinite, volume_term
from supple.materials.laws.isotropic_law import principal_hessian_of
from supple.materials.tet_energies import deformation_gradient, edge_matrix, put_gradient, put_hessian
from supple.numerics.mat3 import cross, det, load_mat, mat_mul_transposed, store_mat
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


@njit(cache=True, parallel=True)
def volume_gradients(x, tets, Dm_inv, volumes, out):
    """d v_e by the nodes of every tet [m^2] into out (m, 4, 3)."""
    for e in prange(len(tets)):
        F = deformation_gradient(x, tets, Dm_inv, e)
        a, b, c = cross(F[3:6], F[6:]), cross(F[6:], F[:3]), cross(F[:3], F[3:6])
        C = (a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2])
        put_gradient(C, load_mat(Dm_inv, e), volumes[e], out, e)


@njit(cache=True, parallel=True)
def star_pressures(x, tets, tet_start, patch_tets, volumes, kind, lam, energies, pressures, stiffness):
    """V_a l_a U [J], p_a = l_a U' [Pa] and l_a U'' / V_a [Pa/m^3] of every patch, into three arrays (v,)."""
    for a in prange(len(volumes)):
        total = 0.0
        for p in range(tet_start[a], tet_start[a + 1]):
            total += det(edge_matrix(x, tets, patch_tets[p]))
        U, first, second = volume_term(kind[a], total / (6.0 * volumes[a]))
        energies[a] = volumes[a] * lam[a] * U
        pressures[a] = lam[a] * first
        stiffness[a] = lam[a] * second / volumes[a]


@njit(cache=True, parallel=True)
def slot_gradients(tet_start, patch_tets, start, slots, of_tets, out):
    """sum_e dv_e of every patch by its slots, into out (s, 3); of_tets : (m, 4, 3) of `volume_gradients`."""
    for a in prange(len(start) - 1):
        for s in range(start[a], start[a + 1]):
            for i in range(3):
                out[s, i] = 0.0
        for p in range(tet_start[a], tet_start[a + 1]):
            e = patch_tets[p]
            for q in range(4):
                for i in range(3):
                    out[slots[e, q], i] += of_tets[e, q, i]


@njit(cache=True, parallel=True)
def pressure_hessians(x, tets, Dm_inv, volumes, pressures, project, out):
    """p_e d^2 v_e of every tet into out (m, 12, 12); in principal stretches, p d^2 J is p s_k between the stretches i
    and j, -p s_k against an in-plane change of shape and p s_k against a twist."""
    for e in prange(len(tets)):
        U, s, V = decompose(deformation_gradient(x, tets, Dm_inv, e))
        p = pressures[e]
        a, b, c = p * s[0], p * s[1], p * s[2]
        A = (0.0, 0.0, 0.0, a, b, c)
        if project:
            A = nearest_semidefinite(A)
            alpha, beta = (0.5 * abs(a), 0.5 * abs(b), 0.5 * abs(c)), (-0.5 * a, -0.5 * b, -0.5 * c)
        else:
            alpha, beta = (0.0, 0.0, 0.0), (-a, -b, -c)
        put_hessian(U, A, alpha, beta, V, load_mat(Dm_inv, e), volumes[e], out, e)


@njit
def _edge_block(frames, turned, k, b, c):
    """The block of slots b and c of edge patch k."""
    f = frames[k]
    U = (f[0], f[1], f[2], f[3], f[4], f[5], f[6], f[7], f[8])
    A = (f[9], f[10], f[11], f[12], f[13], f[14])
    alpha, beta = (f[15], f[16], f[17]), (f[18], f[19], f[20])
    g, h = (turned[b, 0], turned[b, 1], turned[b, 2]), (turned[c, 0], turned[c, 1], turned[c, 2])
    return hessian_block(U, A, alpha, beta, g, h)


@njit(cache=True, parallel=True)
def pair_blocks(
    rows, columns, edge_start, edge_slots, star_start, star_slots, edge_owner, frames, turned, star_owner,
    stiffness, directions, out,
):  # fmt: skip
    """Sum the blocks of each pair into out (p, 3, 3), those of edges first, in the order of the patches.

    Parameters
    ----------
    frames, turned : of `edge_models`; stiffness : of `star_pressures`; directions : of `slot_gradients`
    """
    for n in prange(len(rows)):
        d0 = d1 = d2 = d3 = d4 = d5 = d6 = d7 = d8 = 0.0
        for p in range(edge_start[n], edge_start[n + 1]):
            b, c = edge_slots[p, 0], edge_slots[p, 1]
            K = _edge_block(frames, turned, edge_owner[b], b, c)
            d0 += K[0]
            d1 += K[1]
            d2 += K[2]
            d3 += K[3]
            d4 += K[4]
            d5 += K[5]
            d6 += K[6]
            d7 += K[7]
            d8 += K[8]
        for p in range(star_start[n], star_start[n + 1]):
            b, c = star_slots[p, 0], star_slots[p, 1]
            w = stiffness[star_owner[b]]
            u, v, t = w * directions[b, 0], w * directions[b, 1], w * directions[b, 2]
            x, y, z = directions[c, 0], directions[c, 1], directions[c, 2]
            d0 += u * x
            d1 += u * y
            d2 += u * z
            d3 += v * x
            d4 += v * y
            d5 += v * z
            d6 += t * x
            d7 += t * y
            d8 += t * z
        if rows[n] == columns[n]:
            d1 = d3 = 0.5 * (d1 + d3)
            d2 = d6 = 0.5 * (d2 + d6)
            d5 = d7 = 0.5 * (d5 + d7)
        out[n, 0, 0], out[n, 0, 1], out[n, 0, 2] = d0, d1, d2
        out[n, 1, 0], out[n, 1, 1], out[n, 1, 2] = d3, d4, d5
        out[n, 2, 0], out[n, 2, 1], out[n, 2, 2] = d6, d7, d8
