"""An exponential of the Green strains along and across fibres: psi = C/2 (exp(Q) - 1).

    Q = bf E_ff^2 + bt (E_ss^2 + E_nn^2 + 2 E_sn^2) + 2 bfs (E_fs^2 + E_fn^2),    E = (F^T F - I) / 2.

With a = E f, along = f . a and Q = E : S / 2, S = dQ/dE is linear in E:

    S = 2 bt E + 2 (bfs - bt) (a f^T + f a^T) + 2 (bf + bt - 2 bfs) along f f^T.

The second Piola stress is T = C/2 exp(Q) S, so that P = F T and

    dP = dF T + F (C/2 exp(Q) (S (S : dE) + S(dE))),    dE = sym(F^T dF).

The second part is positive semi-definite for bf, bt, bfs of zero or more; of the first, T_jl delta_ik, it is with the
negative eigenvalues of T left out.

Source: Guccione, McCulloch, Waldman, "Passive material properties of intact ventricular myocardium determined from a
cylindrical model" (1991).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.materials.per_tet import Law

_Array = NDArray[np.float64]


class ExponentialLaw(Law):
    """The law; its parameters are C [Pa], bf, bt, bfs and the unit vector f."""

    counts = range(7, 8)

    def densities(self, F: _Array, p: _Array) -> _Array:
        E = _green(F)
        with np.errstate(over="ignore"):
            psi = 0.5 * p[:, 0] * np.expm1(0.5 * np.einsum("eij,eij->e", E, _slope(E, p)))
        return np.where(np.linalg.det(F) > 0.0, psi, np.inf)

    @np.errstate(over="ignore", invalid="ignore")
    def models(self, F: _Array, p: _Array, second: bool, project: bool) -> tuple[_Array, _Array, _Array]:
        E = _green(F)
        S = _slope(E, p)
        grown = (0.5 * p[:, 0] * np.exp(0.5 * np.einsum("eij,eij->e", E, S)))[:, None, None]
        T = grown * S
        P = np.where((np.linalg.det(F) > 0.0)[:, None, None], F @ T, np.nan)
        if not second:
            return self.densities(F, p), P, np.zeros((0, 9, 9))
        if project:
            T = np.where(np.isfinite(T), T, 0.0)
            values, axes = np.linalg.eigh(T)
            T = np.einsum("eik,ek,ejk->eij", axes, np.maximum(values, 0.0), axes)
        # dE of a unit dF_kl, in the last two axes, for the nine pairs (k, l).
        one = np.eye(3)
        dE = 0.5 * (np.einsum("eki,lj->eklij", F, one) + np.einsum("ekj,li->eklij", F, one)).reshape(-1, 9, 3, 3)
        dS = _slope(dE, p[:, None])
        by_E = grown * np.einsum("eaij,ebij->eab", dE, dS)
        along = np.einsum("eij,eaij->ea", S, dE)
        H = by_E + grown * along[:, :, None] * along[:, None, :]
        return self.densities(F, p), P, H + np.einsum("ik,ejl->eijkl", one, T).reshape(-1, 9, 9)


def _green(F: _Array) -> _Array:
    return 0.5 * (np.swapaxes(F, 1, 2) @ F - np.eye(3))


def _slope(E: _Array, p: _Array) -> _Array:
    """S (..., 3, 3) of strains E (..., 3, 3) and parameters (..., 7)."""
    bf, bt, bfs = (p[..., k, None, None] for k in (1, 2, 3))
    f = np.broadcast_to(p[..., 4:], (*E.shape[:-2], 3))
    a = np.einsum("...ij,...j->...i", E, f)
    af = a[..., :, None] * f[..., None, :]
    along = np.einsum("...i,...i->...", a, f)[..., None, None]
    fibres = 2.0 * (bf + bt - 2.0 * bfs) * along * f[..., :, None] * f[..., None, :]
    return 2.0 * bt * E + 2.0 * (bfs - bt) * (af + np.swapaxes(af, -1, -2)) + fibres


EXPONENTIAL = ExponentialLaw()
