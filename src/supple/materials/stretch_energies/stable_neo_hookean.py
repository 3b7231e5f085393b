"""Stable Neo-Hookean elasticity: psi = mu/2 (Ic - 3) - mu (J - 1) + lam/2 (J - 1)^2.

Source: Smith, de Goes, Kim, "Stable Neo-Hookean Flesh Simulation" (2018), without the logarithmic barrier.
"""

from supple.materials.stretch_energies.stretches import (
    StretchFunctions,
    shape_and_volume,
    squared_volume_change,
    volume_change,
)
from supple.runtime.kernel_cache import njit


@njit
def _density(F, s, mu, lam):
    shape, j = shape_and_volume(F)
    return mu * shape + 0.5 * lam * j * j


@njit
def _pressure(s, mu, lam):
    """c = d psi / d J at fixed Ic."""
    return lam * volume_change(s) - mu


@njit
def _gradient(s, mu, lam):
    """psi_i = mu s_i + c s_j s_k"""
    c = _pressure(s, mu, lam)
    return (mu * s[0] + c * s[1] * s[2], mu * s[1] + c * s[0] * s[2], mu * s[2] + c * s[0] * s[1])


@njit
def _curvature(s, mu, lam):
    """psi_ii = mu + lam (s_j s_k)^2;  psi_ij = lam (s_j s_k)(s_i s_k) + c s_k"""
    c = _pressure(s, mu, lam)
    a, b, d = s[1] * s[2], s[0] * s[2], s[0] * s[1]
    return (
        mu + lam * a * a,
        mu + lam * b * b,
        mu + lam * d * d,
        lam * b * d + c * s[0],
        lam * a * d + c * s[1],
        lam * a * b + c * s[2],
    )


@njit
def _quotients(s, mu, lam):
    """d_ij = mu - c s_k;  t_ij = mu + c s_k"""
    c = _pressure(s, mu, lam)
    return (mu - c * s[0], mu - c * s[1], mu - c * s[2], mu + c * s[0], mu + c * s[1], mu + c * s[2])


FUNCTIONS = StretchFunctions(_density, _gradient, _curvature, _quotients, volume_term=squared_volume_change)
