"""Backtracking line search with Armijo's condition.

Source: Nocedal, Wright, "Numerical Optimization" (2006), section 3.1.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.implicit.energies.potential import HessianBlocks
from supple.implicit.newton.hessian_projection import Convexity
from supple.implicit.newton.objective import Model, Objective

_SUFFICIENT = 1e-4
_SHRINK = 0.5
_MOST_CUTS = 40

# Energies are sums of many terms: differences below this share of the terms' size are round-off, and count as none.
_ROUND_OFF = 1e-13


def backtrack(
    objective: Objective,
    start: Model,
    direction: NDArray[np.float64],
    slope: float,
    largest: float,
    hessian: HessianBlocks | None,
    convexity: Convexity,
) -> tuple[Model, float, int]:
    """Search along `direction` for a sufficient decrease.

    Parameters
    ----------
    start : the objective where the search begins; slope : gradient . direction, negative
    largest : first length to try; hessian, convexity : where the Hessian at the end goes, if it is
        wanted, and of what kind

    Returns
    -------
    end, step, cuts : the objective at the end; the length, 0 where no decrease was found; how often it was halved.
    """
    step = largest
    for cuts in range(_MOST_CUTS):
        moved = start.positions + step * direction
        # Nearly always the first try is good, and then nothing is left to do.
        model = objective.model(moved, hessian, convexity) if cuts == 0 else None
        energy, size = (model.energy, model.size) if model is not None else objective.value_and_size(moved)
        if energy <= start.energy + _SUFFICIENT * step * slope + _ROUND_OFF * max(size, start.size):
            return model or objective.model(moved, hessian, convexity), step, cuts
        step *= _SHRINK
    if hessian is not None:
        objective.model(start.positions, hessian, convexity)
    return start, 0.0, _MOST_CUTS
