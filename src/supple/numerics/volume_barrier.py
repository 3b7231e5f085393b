"""The function of the barriers against inversion: b(y) = -(y - 1)^2 ln y for y < 1, else 0, with y = J / J0.

Source: Li et al., "Incremental Potential Contact" (2020), equation 6, with the volume in place of the distance.
"""

from __future__ import annotations

import math

from supple.runtime.kernel_cache import njit


@njit
def barrier_derivatives(J, onset):
    """b and its first and second derivative by J."""
    y = J / onset
    if not y < 1.0:
        return 0.0, 0.0, 0.0
    if y <= 0.0:
        return math.inf, 0.0, 0.0
    log, ratio = math.log(y), (y - 1.0) / y
    first = -2.0 * (y - 1.0) * log - (y - 1.0) * ratio
    return -(y - 1.0) * (y - 1.0) * log, first / onset, (-2.0 * log - 4.0 * ratio + ratio * ratio) / (onset * onset)
