"""The volume energies of stars, and their derivatives.

With J_a the mean of J over a patch and v_e the volume of tet e,

    d (V_a l_a U(J_a)) = p_a sum_e dv_e,    p_a = l_a U'(J_a),
    d^2 (V_a l_a U(J_a)) = p_a sum_e d^2 v_e + (l_a U'' / V_a) (sum_e dv_e) (sum_e dv_e)^T.
"""

from __future__ import annotations

from supple.materials.isotropic import nearest_semidefinite, volume_term
from supple.materials.tet_energies import deformation_gradient, edge_matrix, put_gradient, put_hessian
from supple.numerics.mat3 import cross, det, load_mat
from supple.numerics.svd3 import svd3 as decompose
from supple.runtime.kernel_cache import njit, prange


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
