"""Inertia: the kinetic part of an implicit step as a potential, |x - x~|^2_M / (2 s)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.runtime.kernel_cache import njit
from supple.solvers.implicit.energies.potential import HessianBlocks, Potential, Projection


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
        return _energy(x, self.masses, self.predicted, self.scale)

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        _add_gradient(x, self.masses, self.predicted, self.scale, out)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        _add_hessian(self.masses, self.scale, out.vertices)


@njit(cache=True)
def _energy(x, masses, predicted, scale):
    total = 0.0
    for i in range(len(x)):
        for k in range(3):
            d = x[i, k] - predicted[i, k]
            total += masses[i] * d * d
    return 0.5 * total / scale


@njit(cache=True)
def _add_gradient(x, masses, predicted, scale, out):
    for i in range(len(x)):
        for k in range(3):
            out[i, k] += masses[i] / scale * (x[i, k] - predicted[i, k])


@njit(cache=True)
def _add_hessian(masses, scale, out):
    for i in range(len(masses)):
        for k in range(3):
            out[i, k, k] += masses[i] / scale
