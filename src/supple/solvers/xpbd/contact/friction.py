"""Coulomb friction with impulses that are accumulated over the sweeps of a substep.

A contact has pushed its sides apart by an impulse f_n >= 0 and holds a tangential impulse f_t. The surfaces have still
slipped by the vector s along each other. The impulse that would reverse the slip is added to f_t, and the sum is
shortened to mu f_n where it is longer: shorter, and the contact sticks; longer, and it slides. Thus |f_t| <= mu f_n
exactly: one coefficient, static and kinetic. A contact that sticks begins the next substep with its f_t.

Source: Macklin, Müller, Chentanez, Kim, "Unified Particle Physics" (2014), section 6.1, with one coefficient;
accumulation: Catto, "Iterative Dynamics with Temporal Coherence" (2005), section 6.
"""

import math

from supple.numerics.mat3 import dot
from supple.runtime.kernel_cache import njit


@njit
def along_surface(v, n):
    """The part of a vector that is perpendicular to the unit normal n."""
    a = dot(v, n)
    return (v[0] - a * n[0], v[1] - a * n[1], v[2] - a * n[2])


@njit
def friction_total(held, slip, n, limit):
    """The tangential correction in total, from the one that is held already.

    Parameters
    ----------
    held : tangential correction of the relative position that is already part of the motion [m]
    slip : relative motion of the surfaces over the substep, including it [m]; only its part along the surface is used
    n : unit normal of the contact
    limit : greatest length of the correction, mu times the normal one [m]
    """
    s = along_surface(slip, n)
    t = (held[0] - s[0], held[1] - s[1], held[2] - s[2])
    length = math.sqrt(dot(t, t))
    if length <= limit:
        return t
    share = limit / length
    return (share * t[0], share * t[1], share * t[2])
