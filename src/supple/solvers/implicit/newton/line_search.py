"""The step along a Newton direction: at most what filters allow, halved until the energy decreases enough.

The energy of contact has jumps, where the features that a vertex is in front of change and their weights do not follow.
A minimum at a jump cannot be reached in steps that lower the energy: a few steps across jumps are allowed.

Sources: Nocedal, Wright, "Numerical Optimization" (2006), section 3.1 (Armijo's condition); Hager, Zhang, "A New
Conjugate Gradient Method with Guaranteed Descent and an Efficient Line Search" (2005), section 4, for slopes in the
place of energies near round-off.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.numerics.inner_product import inner
from supple.solvers.implicit.newton.objective import Model, Objective
from supple.solvers.implicit.step_limits import StepLimits

# The textbook's values: Armijo's c_1, and bisection. 40 halvings are 1e-12 of the direction.
_SUFFICIENT = 1e-4
_SHRINK = 0.5
_MOST_CUTS = 40

# Energies are sums of many terms: differences below this share of the terms' size count as none.
_ROUND_OFF = 1e-13

# Decreases below this share of the terms' size are too near to round-off to show whether a step went beyond the
# minimum. The uphill slope at its end may then be at most this share of the slope at its start. Without this, steps
# alternate across the kinks of a mesh that a frictionless vertex lies on.
_UNCLEAR = 1e-10
_STEEPEST = 0.5

# A convex energy rises by no more than the slope at the end times the length. Where it rises by more than twice that
# within this share of the first length, there is a jump. This many may be crossed in one minimization; contacts that
# are met there keep their weights, so that the same one is not met again.
_SHORT = 1.0 / 16.0
_MOST_JUMPS = 5

# A projected Hessian can be far too stiff: where a body buckles, and where surfaces slide over each other's edges.
# Where this share of the slope is left at the end of a whole step, the step is made longer, up to this many times.
_LEFT = 0.3
_LONGEST = 4.0


@dataclass(eq=False)
class Jumps:
    """How many jumps of the energy have been crossed."""

    crossed: int = 0

    def cross(self, rise: float, uphill: float, round_off: float) -> bool:
        """Whether a short step that raises the energy is to be taken.

        Parameters
        ----------
        rise : of the energy [J]; round_off : its error [J]
        uphill : the slope at the end, times the length of the step [J]
        """
        jump = self.crossed < _MOST_JUMPS and rise > max(2.0 * uphill, 0.0) + round_off
        self.crossed += jump
        return jump


def search(
    objective: Objective,
    start: Model,
    direction: NDArray[np.float64],
    slope: float,
    largest: float,
    limits: StepLimits,
    jumps: Jumps,
) -> tuple[NDArray[np.float64], float, int]:
    """A sufficient decrease along `direction` (n, 3), at an admissible state.

    Parameters
    ----------
    start : the objective where the search begins; slope : gradient . direction
    largest : first length to try; limits : which ends are admissible
    jumps : of this minimization

    Returns
    -------
    end, step, cuts : positions (n, 3); the length, 0 where no decrease was found; how often it was halved.
    """
    if not (slope < 0.0 and largest > 0.0):
        return start.positions, 0.0, 0
    step = largest
    for cuts in range(_MOST_CUTS):
        moved = start.positions + step * direction
        energy, size = objective.value_and_size(moved)
        size = max(size, start.size)
        enough = energy <= start.energy + _SUFFICIENT * step * slope + _ROUND_OFF * size
        if not limits.allows(moved):
            step *= _SHRINK
        elif enough:
            uphill = 0.0
            if -step * slope < _UNCLEAR * size:
                uphill = inner(objective.gradient(moved), direction) / -slope
            if uphill <= _STEEPEST:
                return moved, step, cuts
            step /= 1.0 + uphill
        else:
            rise = energy - start.energy
            if step <= _SHORT * largest and 0.0 < rise < np.inf:
                uphill = step * inner(objective.gradient(moved), direction)
                if jumps.cross(rise, uphill, _ROUND_OFF * size):
                    return moved, step, cuts
            step *= _SHRINK
    return start.positions, 0.0, _MOST_CUTS


def extended(
    objective: Objective,
    start: Model,
    direction: NDArray[np.float64],
    slope: float,
    end: NDArray[np.float64],
    limits: StepLimits,
) -> tuple[NDArray[np.float64], float]:
    """The end of a longer step where the model of the whole one was too stiff, else that one's; and the length.

    The length is that at which the secant of the slopes at both ends is zero.

    Parameters
    ----------
    start, direction, slope, limits : see `search`; end : (n, 3) of the whole step
    """
    left = inner(objective.gradient(end), direction) / slope
    if not left > _LEFT:
        return end, 1.0
    more = (1.0 / (1.0 - left) if left < 1.0 else np.inf) - 1.0
    more = min(more, _LONGEST - 1.0)
    more *= limits.largest_step(end, more * direction).step
    moved = start.positions + (1.0 + more) * direction
    if limits.allows(moved) and objective.value(moved) < objective.value(end):
        return moved, 1.0 + more
    return end, 1.0
