"""Coulomb friction at the level of positions.

Over a substep a contact moves two surfaces apart by `normal` (only the part that takes velocity away counts) and
finds that they have slipped by the vector s along each other. Friction takes back s wholly where |s| <= mu normal (the
contact sticks) and mu normal of it otherwise (it slides). Both corrections are divided between the two sides by the
same inverse masses, so that the impulses obey |f_t| <= mu f_n exactly: one coefficient, static and kinetic.

Source: Macklin, Müller, Chentanez, Kim, "Unified Particle Physics" (2014), section 6.1, with one coefficient.
"""

from __future__ import annotations

import math

from supple.numerics.kernel_cache import njit
from supple.numerics.mat3 import dot


@njit
def friction_correction(slip, n, mu, normal):
    """What is to be added to the relative position to take slip back.

    Parameters
    ----------
    slip : relative motion of the surfaces over the substep [m]; only its part along the surface is used
    n : unit normal of the contact
    mu : coefficient
    normal : correction along n [m], zero or more
    """
    if mu <= 0.0 or normal <= 0.0:
        return (0.0, 0.0, 0.0)
    away = dot(slip, n)
    t = (slip[0] - away * n[0], slip[1] - away * n[1], slip[2] - away * n[2])
    length = math.sqrt(dot(t, t))
    if length <= 0.0:
        return (0.0, 0.0, 0.0)
    share = min(1.0, mu * normal / length)
    return (-share * t[0], -share * t[1], -share * t[2])
