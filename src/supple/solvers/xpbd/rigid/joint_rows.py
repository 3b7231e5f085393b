"""The rows of joints as arrays, and Gauss-Seidel sweeps over them, forward and backward in turn; see `joints`."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.runtime.kernel_cache import njit

Floats = NDArray[np.float64]

# The largest correction, as a share of the joint's size, after which sweeps end.
EXACT = 1e-9


class JointRows(NamedTuple):
    """Rows as kernels receive them; see `joints`.

    Attributes
    ----------
    bodies : (r, 2), -1 for none; actions : (r, 2, 6) force and moment on each body for a unit impulse
    answers : (r, 2, 6) how they move these bodies; total : (r,) inverse masses [1/kg], zero where a row is idle
    missing : (r,) g - g0 [m]; compliance : (r,) 1 / (h^2 k) [1/kg]; low, high : (r,) ends of the impulse [kg m]
    sizes : (r,) of g that count as much as the size of the joint
    """

    bodies: NDArray[np.int64]
    actions: Floats
    answers: Floats
    total: Floats
    missing: Floats
    compliance: Floats
    low: Floats
    high: Floats
    sizes: Floats


@njit
def sweep_joints(rows, impulses, twists, turn):
    """Sweep once over the rows, in place: impulses (r,) [kg m] and twists (b, 6), displacement and rotation of bodies.

    Returns the largest correction, as a share of the joint's size.
    """
    count, largest = len(rows.total), 0.0
    for k in range(count):
        r = k if turn % 2 == 0 else count - 1 - k
        if rows.total[r] == 0.0:
            continue
        g = rows.missing[r] + rows.compliance[r] * impulses[r]
        for side in range(2):
            b = rows.bodies[r, side]
            if b >= 0:
                for i in range(6):
                    g += rows.actions[r, side, i] * twists[b, i]
        p = impulses[r] - g / (rows.total[r] + rows.compliance[r])
        p = min(max(p, rows.low[r]), rows.high[r])
        change = p - impulses[r]
        impulses[r] = p
        largest = max(largest, abs(change) * rows.total[r] / rows.sizes[r])
        for side in range(2):
            b = rows.bodies[r, side]
            if b >= 0:
                for i in range(6):
                    twists[b, i] += rows.answers[r, side, i] * change
    return largest


@njit(cache=True)
def solve_joints(rows, impulses, twists, most):
    """Sweep over the rows of joints alone, at most this many times."""
    for turn in range(most):
        if sweep_joints(rows, impulses, twists, turn) <= EXACT:
            break
