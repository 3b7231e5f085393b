"""Rows of contacts and of joints, solved together: they act on the same twists of rigid bodies."""

import numpy as np

from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.contact.solve import solve
from supple.solvers.xpbd.rigid.joint_rows import sweep_joints

# The largest correction of joints, as a share of their size, after which sweeps end: a tenth of what is looked for.
_SMALL = 1e-6
# Sweeps over joints for one over contacts, at most: these take twenty times as long.
_INNER = 20


@njit(cache=True)
def solve_joined(points, bodies, begin, rows, count, joints, impulses, enough, tolerance, most):
    """Sweep over joints and contacts in turn until both change little, at most this many times; see `solve`.

    joints : their rows, with impulses (r,) [kg m], in place
    enough : contacts are left alone if joints need smaller corrections, as shares of their size

    Returns the largest correction of joints in the first turn, and what the last sweep over contacts changed [m].
    """
    first, residual = np.inf, 0.0
    for turn in range(most):
        largest = 0.0
        for k in range(_INNER):
            off = sweep_joints(joints, impulses, bodies.twists, k)
            largest = max(largest, off)
            if off <= _SMALL:
                break
        if turn == 0:
            first = largest
            if first <= enough:
                break
        _, residual = solve(points, bodies, begin, rows, count, tolerance, 1)
        if largest <= _SMALL and residual <= tolerance:
            break
    return first, residual
