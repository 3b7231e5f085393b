"""The absolute floors of bounds: lengths, momenta and energies that are round-off, or too small to be judged.

Most bounds are shares of what moves. Where nothing moves, that is round-off of positions, or what a solver's tolerance
leaves. Both are compared with the size L of the largest body, the mass M, the weight M g, the stiffness S (elastic
moduli times volume) and the step dt of the recording.
"""

from __future__ import annotations

import numpy as np

from supple.results.check.stored_energies import stiffness_scale, stitch_scale
from supple.results.check.trajectory import Trajectory

# Of L: what bodies move in a step, fall or are strained by, so that it does not count.
_UNSEEN = 1e-6
# Of positions: their round-off, as velocities contain it, which are differences over up to this many substeps.
_ROUNDOFF = 1e3 * float(np.finfo(np.float64).eps)
# Of stiffness and of heights times weight: round-off of energies that are computed twice.
_SUMS = 1e-12


class Floors:
    """The floors of a recording or series.

    Parameters
    ----------
    size : longest extent of the largest body at rest [m]; reach : largest coordinate [m]
    """

    def __init__(self, recording: Trajectory, size: float, reach: float) -> None:
        self._dt, self._size, self._reach, self._mass = recording.dt, size, reach, float(recording.masses.sum())
        self._weight = self._mass * float(np.linalg.norm(recording.gravity))
        self._stiffness = 1e3 * (stiffness_scale(recording) + stitch_scale(recording))

    @property
    def roundoff(self) -> float:
        """Of a position, times the number of substeps [m]."""
        return _ROUNDOFF * self._reach

    @property
    def speed(self) -> float:
        """Velocities that are not seen [m/s]."""
        return (_UNSEEN * self._size + self.roundoff) / self._dt

    @property
    def momentum(self) -> float:
        """Round-off of the sum of all momenta [kg m/s]; that of angular momentum is `size` times this."""
        return self._mass * self.roundoff / self._dt

    @property
    def energy(self) -> float:
        """Of motion, falls and strains that are not seen [J]."""
        moved = 0.5 * self._mass * self.speed**2 + self._weight * (_UNSEEN * self._size + self.roundoff)
        return moved + self._stiffness * _UNSEEN**2 + self.sums

    @property
    def sums(self) -> float:
        """Round-off of the energies of all tets and heights [J]."""
        return _SUMS * (self._stiffness + self._weight * self._reach)
