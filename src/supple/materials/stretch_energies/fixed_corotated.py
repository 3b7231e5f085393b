"""Fixed corotated elasticity: psi = mu sum (s_i - 1)^2 + lam/2 (J - 1)^2.

Source: Stomakhin, Howes, Schroeder, Teran, "Energetically Consistent Invertible Elasticity" (2012), section 3.3.
"""

from supple.materials.stretch_energies.stretches import (
    StretchFunctions,
    distance_from_rotations,
    rotation_quotients,
    squared_volume_change,
    volume_change,
)
from supple.runtime.kernel_cache import njit


@njit
def _density(F, s, mu, lam):
    j = volume_change(s)
    return mu * distance_from_rotations(s) + 0.5 * lam * j * j


@njit
def _gradient(s, mu, lam):
    """psi_i = 2 mu (s_i - 1) + lam (J - 1) s_j s_k"""
    p = lam * volume_change(s)
    return (
        2.0 * mu * (s[0] - 1.0) + p * s[1] * s[2],
        2.0 * mu * (s[1] - 1.0) + p * s[0] * s[2],
        2.0 * mu * (s[2] - 1.0) + p * s[0] * s[1],
    )


@njit
def _curvature(s, mu, lam):
    """psi_ii = 2 mu + lam (s_j s_k)^2;  psi_ij = lam (s_j s_k)(s_i s_k) + lam (J - 1) s_k"""
    p = lam * volume_change(s)
    a, b, d = s[1] * s[2], s[0] * s[2], s[0] * s[1]
    return (
        2.0 * mu + lam * a * a,
        2.0 * mu + lam * b * b,
        2.0 * mu + lam * d * d,
        lam * b * d + p * s[0],
        lam * a * d + p * s[1],
        lam * a * b + p * s[2],
    )


@njit
def _quotients(s, mu, lam):
    """d_ij = 2 mu - lam (J - 1) s_k;  t_ij = 2 mu (1 - 2 / (s_i + s_j)) + lam (J - 1) s_k"""
    p = lam * volume_change(s)
    q = rotation_quotients(s)
    return (
        2.0 * mu - p * s[0],
        2.0 * mu - p * s[1],
        2.0 * mu - p * s[2],
        2.0 * mu * q[0] + p * s[0],
        2.0 * mu * q[1] + p * s[1],
        2.0 * mu * q[2] + p * s[2],
    )


FUNCTIONS = StretchFunctions(
    _density, _gradient, _curvature, _quotients, density_of_stretches=True, volume_term=squared_volume_change
)
