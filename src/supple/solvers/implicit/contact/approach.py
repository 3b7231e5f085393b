"""Rows for what a direction would run into, so that its linear system stops what comes near."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.contact.barrier.collision_rows import CollisionRows, add_row_gradient, row_hessian
from supple.numerics.geometry.embedded_points import vertex_couplings
from supple.solvers.implicit.contact.collisions import Collisions
from supple.solvers.implicit.energies.potential import ContactPotential, HessianBlocks

# Of dhat: the gap that rows keep.
_TARGET = 0.5


@dataclass(frozen=True, eq=False)
class Approach(ContactPotential):
    """Rows, where a linearization begins; their energy does not count.

    stiffness : of a row [N/m]
    """

    collisions: Collisions
    rows: CollisionRows
    stiffness: float

    @classmethod
    def of(cls, collisions: Collisions, stiffness: float) -> Approach:
        """No rows."""
        return cls(collisions, CollisionRows.room(0), stiffness)

    def with_more(self, x: NDArray[np.float64], way: NDArray[np.float64]) -> Approach | None:
        """The rows that push along a `way` (n, 3) from x (n, 3): those that are known, and those of new collisions;
        None where nothing collides."""
        ahead = self.collisions.half_spaces.points.positions(way)
        new = self.collisions.ahead(x, ahead, self.target)
        if not len(new.kinds):
            return None
        rows = self.rows.along(ahead).joined(new)
        return Approach(self.collisions, rows.where(rows.ends < self.target), self.stiffness)

    @property
    def target(self) -> float:
        return _TARGET * self.collisions.dhat

    def value(self, x: NDArray[np.float64]) -> float:
        return 0.0

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        forces = np.zeros_like(self.collisions.points(x))
        add_row_gradient(self.rows, self.stiffness, self.target, forces)
        self.collisions.half_spaces.points.add_forces(forces, out)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        between = row_hessian(self.rows, self.stiffness)
        out.couplings.append(vertex_couplings(self.collisions.half_spaces.points, between))
