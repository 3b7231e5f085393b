"""Neo-Hookean elasticity with a logarithmic barrier: psi = mu/2 (Ic - 3) - mu ln J + lam/2 (ln J)^2, +inf for J <= 0.

Source: Bonet, Wood, "Nonlinear Continuum Mechanics for Finite Element Analysis", section 6.4.3; Li, Jiang, Luo,
"Physics-Based Simulation", chapter "Strain Energy".
"""

import math

import numpy as np

from supple.materials.stretch_energies.stretches import StretchFunctions, shape_and_volume, volume_change
from supple.numerics.mat3 import det
from supple.runtime.kernel_cache import njit


@njit
def _log_J(s):
    """ln J, accurate near the rest state and near collapse."""
    j = volume_change(s)
    return math.log1p(j) if j > -0.5 else math.log(s[0] * s[1] * s[2])


@njit
def _density(F, s, mu, lam):
    shape, j = shape_and_volume(F)
    if j <= -1.0:
        return np.inf
    log_J = math.log1p(j) if j > -0.5 else math.log(det(F))
    return mu * (shape + (j - log_J)) + 0.5 * lam * log_J * log_J


@njit
def _tension(s, mu, lam):
    """c = lam ln J - mu, which stands with 1 / s_i in the stress; not-a-number for J <= 0, without a stress."""
    if s[2] <= 0.0:
        return np.nan
    return lam * _log_J(s) - mu


@njit
def _gradient(s, mu, lam):
    """psi_i = mu s_i + c / s_i"""
    c = _tension(s, mu, lam)
    return (mu * s[0] + c / s[0], mu * s[1] + c / s[1], mu * s[2] + c / s[2])


@njit
def _curvature(s, mu, lam):
    """psi_ii = mu + (lam - c) / s_i^2;  psi_ij = lam / (s_i s_j)"""
    c = _tension(s, mu, lam)
    a, b, d = 1.0 / s[0], 1.0 / s[1], 1.0 / s[2]
    return (
        mu + (lam - c) * a * a,
        mu + (lam - c) * b * b,
        mu + (lam - c) * d * d,
        lam * b * d,
        lam * a * d,
        lam * a * b,
    )


@njit
def _quotients(s, mu, lam):
    """d_ij = mu - c / (s_i s_j);  t_ij = mu + c / (s_i s_j)"""
    c = _tension(s, mu, lam)
    p, q, r = c / (s[1] * s[2]), c / (s[0] * s[2]), c / (s[0] * s[1])
    return (mu - p, mu - q, mu - r, mu + p, mu + q, mu + r)


@njit
def _volume_term(J):
    """(ln J)^2 / 2 and its derivatives."""
    if not J > 0.0:
        return (np.inf, np.nan, np.nan)
    log = math.log(J)
    return (0.5 * log * log, log / J, (1.0 - log) / (J * J))


FUNCTIONS = StretchFunctions(
    _density, _gradient, _curvature, _quotients, needs_positive_volume=True, volume_term=_volume_term
)
