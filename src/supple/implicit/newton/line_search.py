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

from supple.implicit.limits.step_limits import StepLimits
from supple.implicit.newton.objective import Model, Objective

# The textbook's values: Armijo's c_1, and bisection. 40 halvings are 1e-12 of the direction.
_SUFFICIENT = 1e-4
_SHRINK = 0.5
_MOST_CUTS = 40

# Energies are sums of many terms: differences below this share of the terms' size count as none.
_ROUND_OFF = 1e-13

# Decreases below this share of the terms' size are too near to round-off to tell whether a step went beyond the
# minimum: its end then has to be no steeper uphill than this share of the slope at its start. Without it, steps go to
# and fro across the kinks of a mesh that a frictionless vertex lies on.
_UNCLEAR = 1e-10
_STEEPEST = 0.5

# After so many cuts a step is a millionth of its direction: an energy that is still higher has a jump. So many may be
# crossed in one minimization; contacts that are met there keep their weights, so that the same one is not met again.
_TINY = 20
_MOST_JUMPS = 5

# Where a body buckles, the projected Hessian is far too stiff, and steps that shrink by less than this factor crawl:
# directions are then made longer, twice at a time, up to so many times. A step of .25 s of a twisted bar took 97
# iterations with it, and 425 without.
_CRAWL = 0.7
_LONGEST = 16.0


@dataclass(eq=False)
class Jumps:
    """How many jumps of the energy have been crossed."""

    crossed: int = 0

    def cross(self, cuts: int, rise: float, size: float) -> bool:
        """Whether the step after so many cuts, with this rise of the energy [J], is to be taken."""
        jump = cuts == _TINY and rise > _ROUND_OFF * size and self.crossed < _MOST_JUMPS
        self.crossed += jump
        return jump


@dataclass(eq=False)
class Extension:
    """How many times longer than Newton's the directions are made."""

    factor: float = 1.0

    def note(self, step: float, rate: float) -> None:
        """After a step of this share of the direction; rate : length of the direction over that of the last one."""
        if step == 1.0 and rate > _CRAWL:
            self.factor = min(2.0 * self.factor, _LONGEST)
        elif step < 1.0:
            self.factor = max(0.5 * self.factor, 1.0)


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
        enough = energy <= start.energy + _SUFFICIENT * step * slope + _ROUND_OFF * max(size, start.size)
        if enough and limits.allows(moved):
            uphill = 0.0
            if -step * slope < _UNCLEAR * max(size, start.size):
                uphill = float(np.vdot(objective.gradient(moved), direction)) / -slope
            if uphill <= _STEEPEST:
                return moved, step, cuts
            step /= 1.0 + uphill
        elif limits.allows(moved) and jumps.cross(cuts, energy - start.energy, max(size, start.size)):
            return moved, step, cuts
        else:
            step *= _SHRINK
    return start.positions, 0.0, _MOST_CUTS
