"""Splitting the correction of an overlap into a part that changes velocities and a part that does not.

An overlap that existed when the substep began is not caused by the velocities of this substep, so its removal must not
change them: this part moves the positions at the beginning and at the end of the substep alike, by at most `limit`. The
rest is the approach of the surfaces within the substep. It moves the positions at the end only: it stops the approach
and never reverses it (unconditionally inelastic).

Source: the pre-stabilization of Macklin et al., "Unified Particle Physics" (2014), section 4.4.
"""

from supple.numerics.kernel_cache import njit


@njit
def split_overlap(gap, gap_before, limit):
    """(impulse, shift) [m], both zero or more, from the gaps at the end and at the beginning of the substep.

    A gap is negative where surfaces overlap. `limit` is the largest part of an old overlap that one substep removes.
    """
    if gap >= 0.0:
        return 0.0, 0.0
    old = min(-gap, max(0.0, -gap_before))
    return -gap - old, min(old, limit)
