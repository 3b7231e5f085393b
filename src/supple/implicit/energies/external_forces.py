"""Dead loads on vertices, gravity among them, as a potential: -f . x."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.implicit.energies.potential import HessianBlocks, Potential, Projection
from supple.system import System


@dataclass(frozen=True, eq=False)
class ExternalForces(Potential):
    """Forces that do not depend on where the vertices are.

    Parameters
    ----------
    forces : (n, 3) [N]; origin : (n, 3) where the energy is zero [m]
    """

    forces: NDArray[np.float64]
    origin: NDArray[np.float64]
    projection = Projection.UNNEEDED

    def value(self, x: NDArray[np.float64]) -> float:
        return -float(np.einsum("ij,ij->", self.forces, x - self.origin))

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        out -= self.forces

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        """Zero."""


def total_forces(system: System, time: float) -> NDArray[np.float64]:
    """(n, 3) weight and sum of the scene's forces on each vertex at `time` [N]."""
    total = system.masses[:, None] * system.gravity
    for part in system.forces:
        total[part.vertices] += part.per_vertex(time)
    return total
