"""Translations of pieces that nothing holds: known exactly, whatever the accuracy of the linear solver.

Elastic and damping forces do not change when a piece is shifted. Its center of mass therefore moves under inertia,
gravity and loads alone, and the shift that minimizes the objective is -s sum(gradient) / sum(mass).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.system import System


@dataclass(frozen=True, eq=False)
class FreeMotion:
    """The pieces of a system that hang on no pin, no soft target and no obstacle. What stitches join is one piece.

    Attributes
    ----------
    piece : (n,) number of each vertex's free piece, or -1; masses : (n,); totals : (p,) mass of each piece [kg]
    """

    piece: NDArray[np.int32]
    masses: NDArray[np.float64]
    totals: NDArray[np.float64]

    @classmethod
    def of(cls, system: System) -> FreeMotion:
        components = system.joined_components
        held = np.zeros(components.max() + 1, dtype=bool)
        held[components[system.pinned_vertices]] = True
        held[components[system.stitching.anchored_vertices()]] = True
        for part in system.soft_targets:
            held[components[part.vertices]] = True
        number = np.where(held, -1, np.cumsum(~held) - 1)
        piece = number[components].astype(np.int32)
        inside = piece >= 0
        return cls(piece, system.masses, np.bincount(piece[inside], weights=system.masses[inside]).astype(np.float64))

    def correct(self, direction: NDArray[np.float64], gradient: NDArray[np.float64], scale: float) -> None:
        """Replace, in place, the translation of every free piece in a Newton direction by the exact one.

        Parameters
        ----------
        direction, gradient : (n, 3); scale : s of the inertia term [s^2]
        """
        if len(self.totals) == 0:
            return
        inside = self.piece >= 0
        piece = self.piece[inside]
        for k in range(3):
            wrong = np.bincount(piece, weights=self.masses[inside] * direction[inside, k], minlength=len(self.totals))
            total = np.bincount(piece, weights=gradient[inside, k], minlength=len(self.totals))
            direction[inside, k] -= ((wrong + scale * total) / self.totals)[piece]
