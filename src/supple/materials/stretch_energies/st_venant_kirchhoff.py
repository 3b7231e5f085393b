"""St. Venant-Kirchhoff elasticity: psi = mu sum e_i^2 + lam/2 (sum e_i)^2, e_i = (s_i^2 - 1)/2 the Green strains.

Source: Bonet, Wood, "Nonlinear Continuum Mechanics for Finite Element Analysis", section 6.3.
"""

from supple.materials.stretch_energies.stretches import StretchFunctions, green_strain
from supple.runtime.kernel_cache import njit


@njit
def _green_strains(s):
    return (
        0.5 * (s[0] - 1.0) * (s[0] + 1.0),
        0.5 * (s[1] - 1.0) * (s[1] + 1.0),
        0.5 * (s[2] - 1.0) * (s[2] + 1.0),
    )


@njit
def _density(F, s, mu, lam):
    """mu |E|^2 + lam/2 (tr E)^2"""
    a, b, c, d, e, f = green_strain(F)
    trace = a + b + c
    return mu * (a * a + b * b + c * c + 2.0 * (d * d + e * e + f * f)) + 0.5 * lam * trace * trace


@njit
def _gradient(s, mu, lam):
    """psi_i = s_i (2 mu e_i + lam sum e)"""
    e = _green_strains(s)
    p = lam * (e[0] + e[1] + e[2])
    return (s[0] * (2.0 * mu * e[0] + p), s[1] * (2.0 * mu * e[1] + p), s[2] * (2.0 * mu * e[2] + p))


@njit
def _curvature(s, mu, lam):
    """psi_ii = 2 mu e_i + lam sum e + (2 mu + lam) s_i^2;  psi_ij = lam s_i s_j"""
    e = _green_strains(s)
    p = lam * (e[0] + e[1] + e[2])
    m = 2.0 * mu + lam
    return (
        2.0 * mu * e[0] + p + m * s[0] * s[0],
        2.0 * mu * e[1] + p + m * s[1] * s[1],
        2.0 * mu * e[2] + p + m * s[2] * s[2],
        lam * s[1] * s[2],
        lam * s[0] * s[2],
        lam * s[0] * s[1],
    )


@njit
def _quotients(s, mu, lam):
    """d_ij = mu (s_i^2 + s_i s_j + s_j^2 - 1) + lam sum e;  t_ij = mu (s_i^2 - s_i s_j + s_j^2 - 1) + lam sum e"""
    e = _green_strains(s)
    p = lam * (e[0] + e[1] + e[2])
    a, b, d = s[1] * s[2], s[0] * s[2], s[0] * s[1]
    # s_i^2 + s_j^2 - 1 = 2 (e_i + e_j) + 1
    x = mu * (2.0 * (e[1] + e[2]) + 1.0) + p
    y = mu * (2.0 * (e[0] + e[2]) + 1.0) + p
    z = mu * (2.0 * (e[0] + e[1]) + 1.0) + p
    return (x + mu * a, y + mu * b, z + mu * d, x - mu * a, y - mu * b, z - mu * d)


FUNCTIONS = StretchFunctions(_density, _gradient, _curvature, _quotients)
