"""Muscles as potentials: fibres with the tension a S f(s) along their stretch s."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.model.loads.muscles import FibreTension
from supple.model.system import System
from supple.solvers.implicit.energies.potential import HessianBlocks, Potential, Projection


@dataclass(frozen=True, eq=False)
class MusclePotential(Potential):
    """One muscle at one time."""

    muscle: FibreTension
    time: float
    projection = Projection.RELEASED_FIRST

    def value(self, x: NDArray[np.float64]) -> float:
        return self.muscle.energy(x, self.time)

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        pull = np.zeros_like(out)
        self.muscle.add_forces(x, self.time, pull)
        out -= pull

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        """By F d: a S (f' n n^T + f / s (1 - n n^T)); with `project`, the first term where it is positive."""
        m = self.muscle
        stretches, n = m.fibres(x)
        along, across = m.slope(stretches), m.share(stretches) / np.where(stretches > 0.0, stretches, np.inf)
        if project:
            along = np.maximum(along, 0.0)
        factors = m.activation(self.time) * m.strengths
        by_way = (factors * (along - across))[:, None, None] * n[:, :, None] * n[:, None, :]
        by_way += (factors * across)[:, None, None] * np.eye(3)
        blocks = np.einsum("mp,mq,mij->mpiqj", m.coefficients, m.coefficients, by_way)
        out.tets[m.fibres_at_rest.rows] += blocks.reshape(-1, 12, 12)


def muscles_at(system: System, time: float) -> list[MusclePotential]:
    """The muscles of a system at `time` [s]."""
    return [MusclePotential(load, time) for load in system.loads if isinstance(load, FibreTension)]
