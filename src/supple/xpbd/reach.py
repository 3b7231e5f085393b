"""How far vertices may move before lists of what is near them must be made anew."""

from __future__ import annotations

import math

from numba import njit


@njit(cache=True)
def reach_from_velocities(velocities, drift, dt, least, most, out):
    """out (n,) [m]: how far each vertex may get, relative to a common drift [m/s], within dt [s]; bounded both ways."""
    for i in range(len(velocities)):
        a, b, c = velocities[i, 0] - drift[0], velocities[i, 1] - drift[1], velocities[i, 2] - drift[2]
        out[i] = min(most, least + 1.2 * dt * math.sqrt(a * a + b * b + c * c))


@njit(cache=True)
def outran(x, x_gathered, reach, drift):
    """Whether some vertex is further than its reach (n,) from where it was, carried by a drift (3,) [m]."""
    for i in range(len(x)):
        a = x[i, 0] - x_gathered[i, 0] - drift[0]
        b = x[i, 1] - x_gathered[i, 1] - drift[1]
        c = x[i, 2] - x_gathered[i, 2] - drift[2]
        # Written so that a position that is not finite outruns everything.
        if not a * a + b * b + c * c <= reach[i] * reach[i]:
            return True
    return False
