"""An isotropic law: the decomposition of F, the law's values of the principal stretches, and what follows from both."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.materials.isotropic import add_pressure, nearest_semidefinite, store_hessian
from supple.materials.laws.log_strains import VALUES
from supple.materials.per_tet import Law
from supple.numerics.mat3 import load_mat, mat_mul_transposed, store_mat
from supple.numerics.svd3 import svd3 as decompose
from supple.runtime.kernel_cache import njit, prange


@dataclass(frozen=True, eq=False)
class IsotropicLaw(Law):
    """A law of the principal stretches.

    Attributes
    ----------
    kernel : (s (k, 3), p (k, q), out (k, 16)), see `law_kernel`
    """

    kernel: Callable[..., Any]
    counts: range
    infinite_when_flat: bool = False
    bulk: int | None = None

    def densities(self, F: NDArray[np.float64], p: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.decomposed(F, p)[3][:, 0].copy()

    def models(
        self,
        F: NDArray[np.float64],
        p: NDArray[np.float64],
        second: bool,
        project: bool,
        pressures: NDArray[np.float64] | None = None,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """As of `Law`; with pressures (k,), P and the Hessian are those of psi + pressure J."""
        P, H = np.empty((len(F), 3, 3)), np.empty((len(F) if second else 0, 9, 9))
        U, s, V, values = self.decomposed(F, p)
        if pressures is not None:
            _add_pressures(s, pressures, values)
        _models(U, V, values, second, project, P, H)
        return values[:, 0].copy(), P, H

    def stretch_values(self, s: NDArray[np.float64], p: NDArray[np.float64]) -> NDArray[np.float64]:
        """(k, 16) of stretches s (k, 3) and parameters p (k, q): psi, psi_i, psi_ij, quotients d and t."""
        values = np.empty((len(s), VALUES))
        self.kernel(np.ascontiguousarray(s), np.ascontiguousarray(p), values)
        return values

    def decomposed(
        self, F: NDArray[np.float64], p: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """U (k, 3, 3), s (k, 3), V (k, 3, 3) of F = U diag(s) V^T, and the values (k, 16) at s."""
        k = len(F)
        U, s, V = np.empty((k, 3, 3)), np.empty((k, 3)), np.empty((k, 3, 3))
        decompositions(np.ascontiguousarray(F), U, s, V)
        return U, s, V, self.stretch_values(s, p)


@njit(parallel=True, cache=True)
def decompositions(F, U, s, V):
    """F = U diag(s) V^T of every F (k, 3, 3), into U, s (k, 3) and V."""
    for e in prange(len(F)):
        u, values, v = decompose(load_mat(F, e))
        store_mat(u, U, e)
        store_mat(v, V, e)
        s[e, 0], s[e, 1], s[e, 2] = values


@njit
def principal_hessian_of(x, project):
    """`principal_hessian` of `supple.materials.isotropic` of the 16 values x of a tet."""
    A = (x[4], x[5], x[6], x[7], x[8], x[9])
    q = (x[10], x[11], x[12], x[13], x[14], x[15])
    if project:
        A = nearest_semidefinite(A)
        q = (max(q[0], 0.0), max(q[1], 0.0), max(q[2], 0.0), max(q[3], 0.0), max(q[4], 0.0), max(q[5], 0.0))
    alpha = (0.5 * (q[0] + q[3]), 0.5 * (q[1] + q[4]), 0.5 * (q[2] + q[5]))
    beta = (0.5 * (q[0] - q[3]), 0.5 * (q[1] - q[4]), 0.5 * (q[2] - q[5]))
    return A, alpha, beta


@njit(parallel=True, cache=True)
def _add_pressures(s, pressures, values):
    """Change the values of psi (k, 16) at stretches s (k, 3) to those of psi + pressure J, all but psi itself."""
    for e in prange(len(values)):
        p, x, r = pressures[e], values[e], s[e]
        x[1] += p * r[1] * r[2]
        x[2] += p * r[0] * r[2]
        x[3] += p * r[0] * r[1]
        A, q = (x[4], x[5], x[6], x[7], x[8], x[9]), (x[10], x[11], x[12], x[13], x[14], x[15])
        A, q = add_pressure((r[0], r[1], r[2]), p, A, q)
        for k in range(6):
            x[4 + k] = A[k]
            x[10 + k] = q[k]


@njit(parallel=True, cache=True)
def _models(U, V, values, second, project, P, H):
    """Stresses (k, 3, 3) and, with `second`, Hessians (k, 9, 9), see `supple.materials.isotropic`."""
    for e in prange(len(values)):
        u, v, x = load_mat(U, e), load_mat(V, e), values[e]
        scaled = (
            u[0] * x[1], u[1] * x[2], u[2] * x[3],
            u[3] * x[1], u[4] * x[2], u[5] * x[3],
            u[6] * x[1], u[7] * x[2], u[8] * x[3],
        )  # fmt: skip
        store_mat(mat_mul_transposed(scaled, v), P, e)
        if second:
            A, alpha, beta = principal_hessian_of(x, project)
            store_hessian(u, A, alpha, beta, v, H, e)
