"""Energy, gradient and Hessian of every tetrahedron of a mesh, by its four nodes.

With Dm^-1 of the rest shape and F = Ds Dm^-1, the gradient by the nodes is V P Dm^-T, and the Hessian V times d^2 psi
contracted with the shape gradients, block by block (formulas per F: `isotropic.py`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from supple.materials.isotropic import (
    STABLE,
    add_scaled,
    cofactor,
    hessian_block,
    is_kind,
    kernel_of_kinds,
    stable_piola,
)
from supple.numerics.mat3 import cross, dot, load_mat, mat_mul, mat_mul_transposed, transpose
from supple.numerics.svd3 import svd3 as decompose
from supple.runtime.kernel_cache import njit, prange

if TYPE_CHECKING:  # of each kind, see `functions_of`
    from supple.materials.isotropic import KIND, density, energy_density, principal_hessian, stress


@njit
def edge_matrix(x, tets, e):
    """Ds = [x1 - x0, x2 - x0, x3 - x0] of tet e, nine numbers row after row."""
    a, b, c, d = tets[e, 0], tets[e, 1], tets[e, 2], tets[e, 3]
    return (
        x[b, 0] - x[a, 0],
        x[c, 0] - x[a, 0],
        x[d, 0] - x[a, 0],
        x[b, 1] - x[a, 1],
        x[c, 1] - x[a, 1],
        x[d, 1] - x[a, 1],
        x[b, 2] - x[a, 2],
        x[c, 2] - x[a, 2],
        x[d, 2] - x[a, 2],
    )


@njit
def deformation_gradient(x, tets, Dm_inv, e):
    """F = Ds Dm^-1 of tet e, nine numbers row after row."""
    return mat_mul(edge_matrix(x, tets, e), load_mat(Dm_inv, e))


@njit
def put_gradient(P, B, volume, out, e):
    """The gradient of a tet's energy by its four nodes into out[e], for its stress P and B = Dm^-1."""
    G = mat_mul_transposed(P, B)
    for i in range(3):
        total = 0.0
        for k in range(3):
            force = volume * G[3 * i + k]
            out[e, k + 1, i] = force
            total += force
        out[e, 0, i] = -total


@njit
def _symmetric(K):
    """A block of one node with itself, made symmetric to the last bit."""
    a, b, c = 0.5 * (K[1] + K[3]), 0.5 * (K[2] + K[6]), 0.5 * (K[5] + K[7])
    return (K[0], a, b, a, K[4], c, b, c, K[8])


@njit
def _put_pair(out, e, p, q, K):
    """Write block (p, q) of a 12x12 matrix, and its transpose as block (q, p)."""
    for i in range(3):
        for j in range(3):
            value = K[3 * i + j]
            out[e, 3 * p + i, 3 * q + j] = value
            out[e, 3 * q + j, 3 * p + i] = value


@njit
def _minus_sum(A, B, C):
    return (
        -(A[0] + B[0] + C[0]),
        -(A[1] + B[1] + C[1]),
        -(A[2] + B[2] + C[2]),
        -(A[3] + B[3] + C[3]),
        -(A[4] + B[4] + C[4]),
        -(A[5] + B[5] + C[5]),
        -(A[6] + B[6] + C[6]),
        -(A[7] + B[7] + C[7]),
        -(A[8] + B[8] + C[8]),
    )


@njit
def put_hessian(U, A, alpha, beta, V, B, volume, out, e):
    """The 12x12 Hessian of one tet into out[e], for F = U diag(s) V^T and the result of `principal_hessian`; B = Dm^-1,
    whose rows are the shape gradients of nodes 1, 2, 3."""
    v = volume
    A = (v * A[0], v * A[1], v * A[2], v * A[3], v * A[4], v * A[5])
    alpha = (v * alpha[0], v * alpha[1], v * alpha[2])
    beta = (v * beta[0], v * beta[1], v * beta[2])
    G = mat_mul(B, V)
    g1, g2, g3 = (G[0], G[1], G[2]), (G[3], G[4], G[5]), (G[6], G[7], G[8])
    H11 = _symmetric(hessian_block(U, A, alpha, beta, g1, g1))
    H12 = hessian_block(U, A, alpha, beta, g1, g2)
    H13 = hessian_block(U, A, alpha, beta, g1, g3)
    H22 = _symmetric(hessian_block(U, A, alpha, beta, g2, g2))
    H23 = hessian_block(U, A, alpha, beta, g2, g3)
    H33 = _symmetric(hessian_block(U, A, alpha, beta, g3, g3))
    _put_blocks(out, e, H11, H12, H13, H22, H23, H33)


@njit
def _put_blocks(out, e, H11, H12, H13, H22, H23, H33):
    """The 12x12 matrix of a tet into out[e] from the blocks of nodes 1, 2, 3.

    Shape gradients sum to zero, so the blocks of every row do: a translation has exactly zero energy.
    """
    H01 = _minus_sum(H11, transpose(H12), transpose(H13))
    H02 = _minus_sum(H12, H22, transpose(H23))
    H03 = _minus_sum(H13, H23, H33)
    _put_pair(out, e, 0, 0, _symmetric(_minus_sum(H01, H02, H03)))
    _put_pair(out, e, 0, 1, H01)
    _put_pair(out, e, 0, 2, H02)
    _put_pair(out, e, 0, 3, H03)
    _put_pair(out, e, 1, 1, H11)
    _put_pair(out, e, 1, 2, H12)
    _put_pair(out, e, 1, 3, H13)
    _put_pair(out, e, 2, 2, H22)
    _put_pair(out, e, 2, 3, H23)
    _put_pair(out, e, 3, 3, H33)


@njit
def _minus_cross(a, scale, u, v, factor, diagonal):
    """factor u v^T - scale [a]x, and `diagonal` on the diagonal; [a]x w = a x w."""
    x, y, z = scale * a[0], scale * a[1], scale * a[2]
    s, t, r = factor * u[0], factor * u[1], factor * u[2]
    return (
        diagonal + s * v[0],
        s * v[1] + z,
        s * v[2] - y,
        t * v[0] - z,
        diagonal + t * v[1],
        t * v[2] + x,
        r * v[0] + y,
        r * v[1] - x,
        diagonal + r * v[2],
    )


@njit
def _put_stable_hessian(x, tets, B, volume, mu, lam, pressure, out, e):
    """The Hessian of a Stable Neo-Hookean tet with a pressure into out[e], from derivatives of J = det(Ds) det(B)."""
    D = edge_matrix(x, tets, e)
    a, b, d = (D[0], D[3], D[6]), (D[1], D[4], D[7]), (D[2], D[5], D[8])
    g, h, k = B[0:3], B[3:6], B[6:9]
    scale = dot(g, cross(h, k))
    u, v, w = cross(b, d), cross(d, a), cross(a, b)
    J = scale * dot(a, u)
    c = volume * scale * (lam * (J - 1.0) - mu + pressure)
    m, s = volume * mu, volume * lam * scale * scale
    zero = (0.0, 0.0, 0.0)
    _put_blocks(
        out,
        e,
        _minus_cross(zero, 0.0, u, u, s, m * dot(g, g)),
        _minus_cross(d, c, u, v, s, m * dot(g, h)),
        _minus_cross(b, -c, u, w, s, m * dot(g, k)),
        _minus_cross(zero, 0.0, v, v, s, m * dot(h, h)),
        _minus_cross(a, c, v, w, s, m * dot(h, k)),
        _minus_cross(zero, 0.0, w, w, s, m * dot(k, k)),
    )


@kernel_of_kinds(parallel=True)
def element_models(x, tets, Dm_inv, volumes, kind, mu, lam, pressures, second, project, energies, gradients, hessians):
    """Energies (m,), gradients (m, 4, 3) and, with `second`, Hessians (m, 12, 12) of all tets from at most one
    decomposition of each F, which takes most of the time; without `project`, that of Stable Neo-Hookean needs none.

    Parameters
    ----------
    x, tets, Dm_inv, volumes, kind, mu, lam : as of `element_energies`
    pressures : (m,) [Pa]; gradients and Hessians are those of psi + pressure J, energies of psi; or (0,) without any
    second : whether Hessians are wanted; if not, `hessians` is left as it is
    project : see `element_hessians`
    """
    for e in prange(len(tets)):
        if not is_kind(kind[e], KIND):
            continue
        F = deformation_gradient(x, tets, Dm_inv, e)
        B = load_mat(Dm_inv, e)
        pressure = pressures[e] if len(pressures) else 0.0
        if KIND == STABLE and not (second and project):
            energies[e] = volumes[e] * density(F, (0.0, 0.0, 0.0), mu[e], lam[e])
            P = stable_piola(F, mu[e], lam[e])
            if pressure != 0.0:
                P = add_scaled(P, 1.0, cofactor(F), pressure)
            put_gradient(P, B, volumes[e], gradients, e)
            if second:
                _put_stable_hessian(x, tets, B, volumes[e], mu[e], lam[e], pressure, hessians, e)
            continue
        U, s, V = decompose(F)
        energies[e] = volumes[e] * density(F, s, mu[e], lam[e])
        P = stress(U, s, V, mu[e], lam[e])
        if pressure != 0.0:
            P = add_scaled(P, 1.0, cofactor(F), pressure)
        put_gradient(P, B, volumes[e], gradients, e)
        if second:
            A, alpha, beta = principal_hessian(s, mu[e], lam[e], pressure, project)
            put_hessian(U, A, alpha, beta, V, B, volumes[e], hessians, e)


@kernel_of_kinds(parallel=True)
def element_energies(x, tets, Dm_inv, volumes, kind, mu, lam, out):
    """Elastic energy of every tet [J], zero at rest, into out (m,).

    Parameters
    ----------
    x : (n, 3) positions [m]; tets : (m, 4) int32; Dm_inv : (m, 3, 3) rest shape inverse [1/m]; volumes : (m,) [m^3];
    kind, mu, lam : (m,) of `TetMaterial`. All C-contiguous; float64, but int32 for tets and kind.
    """
    for e in prange(len(tets)):
        if is_kind(kind[e], KIND):
            out[e] = volumes[e] * energy_density(deformation_gradient(x, tets, Dm_inv, e), mu[e], lam[e])


def element_gradients(x, tets, Dm_inv, volumes, kind, mu, lam, out) -> None:
    """Gradient of every tet's energy by its four nodes [N] (minus the elastic forces), into out (m, 4, 3).

    Parameters as of `element_energies`.
    """
    tet = x, tets, Dm_inv, volumes, kind, mu, lam, np.zeros(0)
    element_models(*tet, False, False, np.empty(len(tets)), out, np.empty((0, 12, 12)))


def element_hessians(x, tets, Dm_inv, volumes, kind, mu, lam, project, out) -> None:
    """Hessian of every tet's energy [N/m] into out (m, 12, 12): entry (3 p + i, 3 q + k) for coordinate i of node p and
    coordinate k of node q. With `project`, of the nearest convex energy: eigenvalues of d^2 psi / dF^2 are clamped.

    Other parameters as of `element_energies`.
    """
    tet = x, tets, Dm_inv, volumes, kind, mu, lam, np.zeros(0)
    element_models(*tet, True, project, np.empty(len(tets)), np.empty((len(tets), 4, 3)), out)
