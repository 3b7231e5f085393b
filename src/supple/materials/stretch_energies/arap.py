"""As-rigid-as-possible elasticity: psi = mu sum (s_i - 1)^2 = mu |F - R|^2.

Sources: Sorkine, Alexa, "As-Rigid-As-Possible Surface Modeling" (2007); Kim, Eberle, "Dynamic Deformables" (2022),
chapter 5.
"""

from supple.materials.stretch_energies.stretches import StretchFunctions, distance_from_rotations, rotation_quotients
from supple.runtime.kernel_cache import njit


@njit
def _density(F, s, mu, lam):
    return mu * distance_from_rotations(s)


@njit
def _gradient(s, mu, lam):
    return (2.0 * mu * (s[0] - 1.0), 2.0 * mu * (s[1] - 1.0), 2.0 * mu * (s[2] - 1.0))


@njit
def _curvature(s, mu, lam):
    return (2.0 * mu, 2.0 * mu, 2.0 * mu, 0.0, 0.0, 0.0)


@njit
def _quotients(s, mu, lam):
    """d_ij = 2 mu;  t_ij = 2 mu (1 - 2 / (s_i + s_j))"""
    q = rotation_quotients(s)
    return (2.0 * mu, 2.0 * mu, 2.0 * mu, 2.0 * mu * q[0], 2.0 * mu * q[1], 2.0 * mu * q[2])


FUNCTIONS = StretchFunctions(_density, _gradient, _curvature, _quotients, density_of_stretches=True)
