"""Translations of pieces that nothing holds are known exactly, independent of the accuracy of the linear solver.

Elastic and damping forces do not change when a piece is shifted. Its center of mass therefore moves under inertia,
gravity and loads alone, and the shift that minimizes the objective is -s sum(gradient) / sum(mass).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bsr_matrix

from supple.mesh.topology import graph_components
from supple.system import System


@dataclass(frozen=True, eq=False)
class FreeMotion:
    """The pieces of a system that no pin, soft target or stitch to an obstacle holds. Stitched bodies are one piece.

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

    def joined(self, couplings: Sequence[bsr_matrix]) -> FreeMotion:
        """The same with pieces in contact as one piece, without those in contact with something held."""
        if not couplings or len(self.totals) == 0:
            return self
        held = len(self.totals)
        ends = [np.repeat(np.arange(len(self.piece)), np.diff(c.indptr)) for c in couplings]
        pairs = np.stack(
            [self.piece[np.concatenate(ends)], self.piece[np.concatenate([c.indices for c in couplings])]], axis=1
        )
        pairs = np.unique(np.where(pairs < 0, held, pairs), axis=0)
        cluster = graph_components(held + 1, pairs[:, 0], pairs[:, 1])
        number = np.where(np.arange(cluster.max() + 1) == cluster[held], -1, 0)
        number[number == 0] = np.arange(int((number == 0).sum()))
        piece = np.where(self.piece >= 0, number[cluster[self.piece]], -1).astype(np.int32)
        inside = piece >= 0
        totals = np.bincount(piece[inside], weights=self.masses[inside], minlength=int((number >= 0).sum()))
        return FreeMotion(piece, self.masses, totals.astype(np.float64))

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
