"""The absolute floors of bounds: lengths, momenta and energies that are round-off, or too small to be judged.

Most bounds are shares of what moves. Where nothing moves, that is round-off of positions, or what a solver's tolerance
leaves. Both are compared with the size L of the largest body, the mass M, the weight M g, the stiffness S (elastic
moduli times volume) and the step dt of the recording.
"""

from __future__ import annotations

import numpy as np

from supple.results.check.energies import stiffness_scale
from supple.results.check.known import Known

# Of L: what bodies move in a step, fall or are strained by, so that it does not count.
_UNSEEN = 1e-6
# Of positions: their round-off, as velocities contain it, which are differences over up to this many substeps.
_ROUNDOFF = 1e3 * float(np.finfo(np.float64).eps)
# Of stiffness and of heights times weight: round-off of energies that are computed twice.
_SUMS = 1e-12


class Floors:
    """The floors of a recording or series.

    Attributes
    ----------
    roundoff : of a position, times the number of substeps [m]
    speed : velocities that are not seen [m/s]
    momentum : round-off of the sum of all momenta [kg m/s]; that of angular momentum is the size times this
    sums : round-off of the energies of all tets and heights [J]
    energy : of motion, falls and strains that are not seen [J]
    """

    def __init__(self, of: Known) -> None:
        # The largest coordinate at rest and in the first frame [m].
        places = of.rest_positions, of.snapshot(0).positions
        reach = max(float(np.abs(x[np.isfinite(x).all(axis=1)]).max(initial=0.0)) for x in places)
        mass, stiffness, moved = float(of.masses.sum()), 1e3 * stiffness_scale(of), _UNSEEN * of.size
        weight = mass * float(np.linalg.norm(of.gravity))
        self.roundoff = _ROUNDOFF * reach
        self.speed = (moved + self.roundoff) / of.dt
        self.momentum = mass * self.roundoff / of.dt
        self.sums = _SUMS * (stiffness + weight * reach)
        fallen = weight * (moved + self.roundoff)
        self.energy = 0.5 * mass * self.speed**2 + fallen + stiffness * _UNSEEN**2 + self.sums
