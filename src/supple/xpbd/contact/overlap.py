"""Dividing the correction of an overlap into what velocities must feel and what they must not.

An overlap that was there when the substep began came from no velocity of this substep, so mending it must give none:
that part moves positions at the beginning and at the end of the substep alike, and no faster than `limit`. The rest is
what the surfaces approached each other in the substep, and moves the end only: it takes the approach away, and never
gives back more (unconditionally inelastic).

Source: the pre-stabilization of Macklin et al., "Unified Particle Physics" (2014), section 4.4.
"""

from __future__ import annotations

from supple.numerics.kernel_cache import njit


@njit
def split_overlap(gap, gap_before, limit):
    """(impulse, shift) [m], both zero or more, for gaps at the end and at the beginning of the substep.

    `gap` is below zero where surfaces overlap. `limit` is the most that an old overlap is mended in one substep.
    """
    if gap >= 0.0:
        return 0.0, 0.0
    old = min(-gap, max(0.0, -gap_before))
    return -gap - old, min(old, limit)
