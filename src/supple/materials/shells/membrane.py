"""Energies of stretches in the plane of a shell, in plane stress, per area at rest and thickness.

With the Green strain E = (C - 1)/2 of a triangle's F (3, 2), C = F^T F, J^2 = det C, and a = nu / (1 - nu):

    neo-Hookean             psi = mu/2 (tr C - 2 + (J^(-2 a) - 1) / a),   - 2 ln J in place of the quotient where a = 0
    St. Venant-Kirchhoff    psi = mu E : E + lam/2 (tr E)^2,              lam = 2 mu a

The first is Ogden's compressible neo-Hookean energy mu/2 (tr C_3 - 3 + (J_3^(-2 b) - 1)/b), b = nu/(1 - 2 nu), where no
stress acts along the normal: the stretch of the thickness is then J^(-a). At nu = 1/2 it is incompressible. Stresses
are S = 2 d psi/dC, and tangents dS/dE, in the components 11, 22, 12 of the stress and 11, 22, 2 x 12 of the strain.

Source: Ogden, "Non-linear Elastic Deformations" (1984), section 7.2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.runtime.kernel_cache import njit

Floats = NDArray[np.float64]


def strains(F: Floats) -> Floats:
    """(t, 3) the Green strain 11, 22 and 2 x 12 of F (t, 3, 2)."""
    C = np.swapaxes(F, 1, 2) @ F
    return np.column_stack([0.5 * (C[:, 0, 0] - 1.0), 0.5 * (C[:, 1, 1] - 1.0), C[:, 0, 1]])


def neo_hookean_energies(E: Floats, mu: Floats, a: Floats) -> Floats:
    """(t,) [Pa]; infinite where a triangle has no area."""
    _, log_det = _metric(E)
    few = np.abs(a) < 1e-9
    powers = np.where(few, -log_det, np.expm1(-a * log_det) / np.where(few, 1.0, a))
    return mu * (E[:, 0] + E[:, 1] + 0.5 * powers)


def neo_hookean_stresses(E: Floats, mu: Floats, a: Floats) -> tuple[Floats, Floats]:
    """The stresses (t, 3) and their tangents (t, 3, 3) [Pa]; these are positive semi-definite for every strain."""
    k, log_det = _metric(E)  # the inverse of C
    power = mu * np.exp(-a * log_det)
    stress = mu[:, None] * np.array([1.0, 1.0, 0.0]) - power[:, None] * k
    k11, k22, k12 = k.T
    both = np.empty((len(E), 3, 3))
    both[:, 0, 0], both[:, 1, 1], both[:, 2, 2] = k11 * k11, k22 * k22, 0.5 * (k11 * k22 + k12 * k12)
    both[:, 0, 1] = both[:, 1, 0] = k12 * k12
    both[:, 0, 2] = both[:, 2, 0] = k11 * k12
    both[:, 1, 2] = both[:, 2, 1] = k12 * k22
    return stress, 2.0 * power[:, None, None] * (a[:, None, None] * k[:, :, None] * k[:, None, :] + both)


def st_venant_kirchhoff_tangents(mu: Floats, a: Floats) -> Floats:
    """(t, 3, 3) [Pa]; the stress is the tangent times the strain."""
    out = np.zeros((len(mu), 3, 3))
    out[:, 0, 0] = out[:, 1, 1] = 2.0 * mu * (1.0 + a)
    out[:, 0, 1] = out[:, 1, 0] = 2.0 * mu * a
    out[:, 2, 2] = mu
    return out


def tension_only(S: Floats) -> Floats:
    """(t, 3) the nearest positive semi-definite stresses: compressions become zero."""
    mean, half = 0.5 * (S[:, 0] + S[:, 1]), 0.5 * (S[:, 0] - S[:, 1])
    radius = np.hypot(half, S[:, 2])
    high, low = np.maximum(mean + radius, 0.0), np.maximum(mean - radius, 0.0)
    center, scale = 0.5 * (high + low), 0.5 * (high - low) / np.where(radius > 0.0, radius, 1.0)
    return np.column_stack([center + scale * half, center - scale * half, scale * S[:, 2]])


def _metric(E: Floats) -> tuple[Floats, Floats]:
    """C^-1 (t, 3) in the components 11, 22, 12, and ln det C (t,); infinite where det C is not above zero."""
    c11, c22, c12 = 1.0 + 2.0 * E[:, 0], 1.0 + 2.0 * E[:, 1], E[:, 2]
    det = c11 * c22 - c12 * c12
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.column_stack([c22, c11, -c12]) / det[:, None], np.log(np.maximum(det, 0.0))


@njit(cache=True)
def add_stretching(F, gradients, volumes, S, tangents, out):
    """V (B_p^T D B_q + (g_p . S g_q) 1): B_p the strains of corner p, D the tangents (t, 3, 3), S (t, 3) stresses.

    out : (21 t, 3, 3) see `hinges`
    """
    B, DB = np.empty((3, 3, 3)), np.empty((3, 3))
    for t in range(len(F)):
        for p in range(3):
            g, h = gradients[t, p, 0], gradients[t, p, 1]
            for i in range(3):
                B[p, 0, i], B[p, 1, i] = F[t, i, 0] * g, F[t, i, 1] * h
                B[p, 2, i] = F[t, i, 0] * h + F[t, i, 1] * g
        for q in range(3):
            g, h = gradients[t, q, 0], gradients[t, q, 1]
            along, across = S[t, 0] * g + S[t, 2] * h, S[t, 2] * g + S[t, 1] * h
            for a in range(3):
                for j in range(3):
                    DB[a, j] = 0.0
                    for b in range(3):
                        DB[a, j] += volumes[t] * tangents[t, a, b] * B[q, b, j]
            for p in range(q + 1):
                stress = volumes[t] * (gradients[t, p, 0] * along + gradients[t, p, 1] * across)
                k = 21 * t + 6 * p + q - p * (p + 1) // 2
                for i in range(3):
                    out[k, i, i] += stress
                    for j in range(3):
                        out[k, i, j] += B[p, 0, i] * DB[0, j] + B[p, 1, i] * DB[1, j] + B[p, 2, i] * DB[2, j]
