"""The barrier of one distance: an energy per area that grows without bound as the distance goes to zero.

    e(d) = dhat b(d^2 / dhat^2),  b(s) = -(s - 1)^2 ln s  for s < 1, else 0

Times a pressure and an area it is an energy.

Source: Li et al., "Incremental Potential Contact" (2020), equation 6; Li et al., "Convergent Incremental Potential
Contact" (2023), for the unit.
"""

import math

from supple.runtime.kernel_cache import njit


@njit
def barrier_value(d, dhat):
    """e(d) [m] for d > 0."""
    if d >= dhat:
        return 0.0
    r = d / dhat
    # s - 1 = (r - 1)(r + 1) has no cancellation near dhat.
    below = (r - 1.0) * (r + 1.0)
    return -dhat * below * below * 2.0 * math.log(r)


@njit
def barrier_slopes(d, dhat):
    """First and second derivative of e by d [1, 1/m] for d > 0: not above and not below zero."""
    if d >= dhat:
        return 0.0, 0.0
    r = d / dhat
    s = r * r
    below = (r - 1.0) * (r + 1.0)
    log = 2.0 * math.log(r)
    first = -below * (2.0 * log + below / s)
    second = -2.0 * log - 4.0 * below / s + below * below / (s * s)
    return 2.0 * r * first, (4.0 * s * second + 2.0 * first) / dhat
