"""Energies of every vertex on its own, which are quadratic: inertia, weight and dead loads, soft targets, drag."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.runtime.kernel_cache import njit
from supple.solvers.implicit.energies.potential import HessianBlocks, Potential, Projection


@dataclass(frozen=True, eq=False)
class VertexPotential(Potential):
    """sum_i (sum_j k_ij d_ij^2 / 2 - f_i . d_i), d = x - o.

    Parameters
    ----------
    origin : (n, 3) o [m]; stiffness : (n, 3) k along x, y and z [N/m], zero or more; forces : (n, 3) f [N]
    work : see `Potential`
    """

    origin: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    forces: NDArray[np.float64]
    work: str | None = None
    projection = Projection.UNNEEDED

    def value(self, x: NDArray[np.float64]) -> float:
        return _energy(x, self.origin, self.stiffness, self.forces)

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        _add_gradient(x, self.origin, self.stiffness, self.forces, out)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        for k in range(3):
            out.vertices[:, k, k] += self.stiffness[:, k]


def inertia(masses: NDArray[np.float64], predicted: NDArray[np.float64], scale: float) -> VertexPotential:
    """The kinetic part of a step, |x - x~|^2_M / (2 s): its minimum is the state that vertices reach without forces.

    Parameters
    ----------
    masses : (n,) [kg]; predicted : (n, 3) x~ [m]
    scale : s [s^2], such that x = x~ + s a for an acceleration a

    Source: Li, Jiang, Luo, "Physics-Based Simulation", chapter "Optimization Framework": the incremental potential,
    here divided by h^2 so that it is an energy and its gradient a force.
    """
    return VertexPotential(predicted, np.repeat(masses[:, None] / scale, 3, axis=1), np.zeros_like(predicted))


@njit(cache=True)
def _energy(x, origin, stiffness, forces):
    total = 0.0
    for i in range(len(x)):
        for k in range(3):
            d = x[i, k] - origin[i, k]
            total += (0.5 * stiffness[i, k] * d - forces[i, k]) * d
    return total


@njit(cache=True)
def _add_gradient(x, origin, stiffness, forces, out):
    for i in range(len(x)):
        for k in range(3):
            out[i, k] += stiffness[i, k] * (x[i, k] - origin[i, k]) - forces[i, k]
