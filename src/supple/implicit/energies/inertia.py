"""Inertia: the kinetic part of an implicit step as a potential, |x - x~|^2_M / (2 s)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.implicit.energies.potential import HessianBlocks, Potential, Projection


@dataclass(frozen=True, eq=False)
class Inertia(Potential):
    """The energy whose minimum is the predicted state, which every vertex would reach without forces.

    Parameters
    ----------
    masses : (n,) [kg]; predicted : (n, 3) x~ [m]
    scale : s [s^2], such that x = x~ + s a for an acceleration a

    Source: physics of the step, Li, Jiang, Luo, "Physics-Based Simulation", chapter "Optimization Framework": the
    incremental potential, here divided by h^2 so that it is an energy and its gradient a force.
    """

    masses: NDArray[np.float64]
    predicted: NDArray[np.float64]
    scale: float
    projection = Projection.UNNEEDED

    def value(self, x: NDArray[np.float64]) -> float:
        d = x - self.predicted
        return 0.5 * float(np.einsum("i,ij,ij->", self.masses, d, d)) / self.scale

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        out += (self.masses / self.scale)[:, None] * (x - self.predicted)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        for k in range(3):
            out.vertices[:, k, k] += self.masses / self.scale
