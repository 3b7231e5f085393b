"""Translations of pieces that nothing holds are known exactly, independent of the accuracy of the linear solver.

Elastic and damping forces do not change when a piece is shifted. Its center of mass therefore moves under inertia,
gravity and loads alone, and the shift that minimizes the objective is -s sum(gradient) / sum(mass).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.model.loads.springs import PointSpring
from supple.model.system import System
from supple.numerics.joined_sets import unite
from supple.numerics.sparse.couplings import Couplings
from supple.runtime.kernel_cache import njit


@dataclass(frozen=True, eq=False)
class FreeMotion:
    """The pieces of a system that nothing holds: no pin, soft target, spring or cable to the world, stitch to an
    obstacle, or joint with one or with the world.

    Bodies that stitches or joints join are one piece.

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
        begins = {part.name: part.vertices.start for part in system.bodies}
        for joint in system.scene.joints:
            if joint.second not in begins:
                held[components[begins[joint.first]]] = True
        for load in system.loads:
            if isinstance(load, PointSpring) and load.is_anchored:
                held[components[load.vertices]] = True
        for actuator in system.actuators:
            if actuator.coordinate.is_anchored:
                held[components[actuator.coordinate.vertices]] = True
        number = np.where(held, -1, np.cumsum(~held) - 1)
        piece = number[components].astype(np.int32)
        inside = piece >= 0
        return cls(piece, system.masses, np.bincount(piece[inside], weights=system.masses[inside]).astype(np.float64))

    def joined(self, couplings: Sequence[Couplings]) -> FreeMotion:
        """The same with pieces in contact as one piece, without those in contact with something held."""
        if not couplings or len(self.totals) == 0:
            return self
        held = len(self.totals)
        root = np.arange(held + 1, dtype=np.int32)
        for part in couplings:
            unite(part.rows, part.columns, self.piece, root)
        free = np.flatnonzero(root != root[held])
        _, joined = np.unique(root[free], return_inverse=True)
        number = np.full(held + 1, -1, dtype=np.int32)
        number[free] = joined
        totals = np.bincount(joined, weights=self.totals[free]).astype(np.float64)
        return FreeMotion(number[self.piece], self.masses, totals)

    def correct(self, direction: NDArray[np.float64], gradient: NDArray[np.float64], scale: float) -> None:
        """Replace, in place, the translation of every free piece in a Newton direction by the exact one.

        Parameters
        ----------
        direction, gradient : (n, 3); scale : s of the inertia term [s^2]
        """
        if len(self.totals):
            _correct(self.piece, self.masses, self.totals, gradient, scale, direction)


@njit(cache=True)
def _correct(piece, masses, totals, gradient, scale, direction):
    shift = np.zeros((len(totals), 3))
    for v in range(len(piece)):
        if piece[v] >= 0:
            for k in range(3):
                shift[piece[v], k] += masses[v] * direction[v, k] + scale * gradient[v, k]
    for v in range(len(piece)):
        if piece[v] >= 0:
            for k in range(3):
                direction[v, k] -= shift[piece[v], k] / totals[piece[v]]
