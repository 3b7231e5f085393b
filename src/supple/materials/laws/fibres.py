"""One family of fibres that carry tension only, with dispersed directions.

    psi = k1 / (2 k2) (exp(k2 E^2) - 1)  for E > 0, else 0,    E = tr(C M) - 1,    C = F^T F,
    M = kappa I + (1 - 3 kappa) a a^T,    that is E = kappa (I1 - 3) + (1 - 3 kappa) (I4 - 1).

a is the mean direction at rest; kappa = 0 are parallel fibres, kappa = 1/3 fibres in all directions alike. E is convex
in F and psi convex and increasing in E, so psi is convex: its Hessian

    4 psi'' (F M) (F M)^T + 2 psi' I x M,    as entries (ij, kl): 4 psi'' (F M)_ij (F M)_kl + 2 psi' delta_ik M_jl,

needs no projection. I1 and I4 are of F itself: with the change of volume taken out of them, fibres under tension
would make a body grow (Helfenstein et al., "On non-physical response in models for fiber-reinforced hyperelastic
materials", 2010).

Source: Gasser, Ogden, Holzapfel, "Hyperelastic modelling of arterial layers with distributed collagen fibre
orientations" (2006).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from supple.materials.per_tet import Law
from supple.numerics.mat3 import det, load_mat
from supple.runtime.kernel_cache import njit, prange


class FibreLaw(Law):
    """The law; its parameters are k1 [Pa], k2, kappa and the unit vector a."""

    counts = range(6, 7)

    def densities(self, F: NDArray[np.float64], p: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.models(F, p, False, False)[0]

    def models(
        self, F: NDArray[np.float64], p: NDArray[np.float64], second: bool, project: bool
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        psi, P = np.empty(len(F)), np.empty((len(F), 3, 3))
        H = np.empty((len(F) if second else 0, 9, 9))
        _models(np.ascontiguousarray(F), np.ascontiguousarray(p), second, psi, P, H)
        return psi, P, H


@njit(parallel=True, cache=True)
def _models(F, p, second, psi, P, H):
    for e in prange(len(F)):
        k1, k2, kappa = p[e, 0], p[e, 1], p[e, 2]
        M, FM = np.empty((3, 3)), np.empty((3, 3))
        for i in range(3):
            for j in range(3):
                M[i, j] = (1.0 - 3.0 * kappa) * p[e, 3 + i] * p[e, 3 + j] + (kappa if i == j else 0.0)
        E = -1.0
        for i in range(3):
            for j in range(3):
                FM[i, j] = F[e, i, 0] * M[0, j] + F[e, i, 1] * M[1, j] + F[e, i, 2] * M[2, j]
                E += F[e, i, j] * FM[i, j]
        grown = math.exp(k2 * E * E) if E > 0.0 else 0.0
        first, curvature = k1 * max(E, 0.0) * grown, k1 * (1.0 + 2.0 * k2 * E * E) * grown
        psi[e] = 0.5 * k1 / k2 * math.expm1(k2 * E * E) if E > 0.0 else 0.0
        if not det(load_mat(F, e)) > 0.0:
            psi[e], first = np.inf, np.nan
        for i in range(3):
            for j in range(3):
                P[e, i, j] = 2.0 * first * FM[i, j]
        if second:
            for i in range(3):
                for j in range(3):
                    for k in range(3):
                        for n in range(3):
                            value = 4.0 * curvature * (FM[i, j] * FM[k, n])
                            if i == k:
                                value += 2.0 * first * M[j, n]
                            H[e, 3 * i + j, 3 * k + n] = value


FIBRES = FibreLaw()
