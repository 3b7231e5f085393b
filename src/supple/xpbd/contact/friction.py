"""Coulomb friction at the level of positions.

In a substep a contact moves two surfaces apart by `normal` (only the part that removes velocity counts); the surfaces
have slipped by the vector s along each other. Friction reverses all of s where |s| <= mu normal (the contact sticks),
and a length mu normal of it otherwise (it slides). Both corrections are divided between the two sides by the same
inverse masses, so that the impulses satisfy |f_t| <= mu f_n exactly: one coefficient, static and kinetic.

Source: Macklin, Müller, Chentanez, Kim, "Unified Particle Physics" (2014), section 6.1, with one coefficient.
"""

import math

from supple.numerics.kernel_cache import njit
from supple.numerics.mat3 import dot


@njit
def friction_correction(slip, n, mu, normal):
    """Correction of the relative position that reverses the slip.

    Parameters
    ----------
    slip : relative motion of the surfaces over the substep [m]; only its part along the surface is used
    n : unit normal of the contact
    mu : coefficient
    normal : correction along n [m], zero or more
    """
    if mu <= 0.0 or normal <= 0.0:
        return (0.0, 0.0, 0.0)
    along = dot(slip, n)
    t = (slip[0] - along * n[0], slip[1] - along * n[1], slip[2] - along * n[2])
    length = math.sqrt(dot(t, t))
    if length <= 0.0:
        return (0.0, 0.0, 0.0)
    share = min(1.0, mu * normal / length)
    return (-share * t[0], -share * t[1], -share * t[2])
