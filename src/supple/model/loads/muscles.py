"""Muscles on the tets of a system: the energy per volume a S G(s) with G' = f, see `supple.scene.loads.muscle`.

With the shape gradients b_p of a tet, F d = sum c_p x_p for c_p = b_p . d: a fibre is a spring between its vertices.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic_tets.active import ActiveTets
from supple.model.loads.applied import ActiveLoad


@dataclass(frozen=True, eq=False)
class FibreTension(ActiveLoad):
    """The fibres of one muscle, one in each of its tets.

    Attributes
    ----------
    fibres_at_rest : without activation; tets : (m, 4) their vertices
    coefficients : (m, 4) c [1/m]; strengths : (m,) S times the volumes at rest [J]
    activation : time -> a; curve : stretches and values of f
    """

    fibres_at_rest: ActiveTets
    tets: NDArray[np.int32]
    coefficients: NDArray[np.float64]
    strengths: NDArray[np.float64]
    activation: Callable[[float], float]
    curve: tuple[NDArray[np.float64], NDArray[np.float64]]

    work = "muscles"

    def renumbered(self, new: NDArray[np.int32]) -> FibreTension:
        return replace(self, tets=new[self.tets])

    def acts_on(self) -> NDArray[np.int32]:
        return np.unique(self.tets)

    def add_forces(self, x: NDArray[np.float64], time: float, out: NDArray[np.float64]) -> None:
        stretches, directions = self.fibres(x)
        pull = (-self.activation(time) * self.strengths * self.share(stretches))[:, None] * directions
        for corner, c in zip(self.tets.T, self.coefficients.T, strict=True):
            for axis in range(3):
                out[:, axis] += np.bincount(corner, c * pull[:, axis], len(out))

    def active(self, time: float) -> ActiveTets:
        return self.fibres_at_rest.at(self.activation(time))

    def fibres(self, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Stretches (m,) and unit vectors (m, 3) of the fibres at x (n, 3); zero for a fibre without length."""
        fibres = np.einsum("mp,mpi->mi", self.coefficients, x[self.tets])
        stretches = np.sqrt(np.einsum("mi,mi->m", fibres, fibres))
        return stretches, fibres / np.where(stretches > 0.0, stretches, np.inf)[:, None]

    def energy(self, x: NDArray[np.float64], time: float) -> float:
        """From the rest state [J]."""
        integral = self._integral(self.fibres(x)[0]) - self._integral(np.ones(1))
        return self.activation(time) * float(self.strengths @ integral)

    def share(self, stretches: NDArray[np.float64]) -> NDArray[np.float64]:
        """(m,) f"""
        return np.interp(stretches, *self.curve)

    def slope(self, stretches: NDArray[np.float64]) -> NDArray[np.float64]:
        """(m,) df / ds"""
        knots, values = self.curve
        slopes = np.concatenate([[0.0], np.diff(values) / np.diff(knots), [0.0]])
        return slopes[np.searchsorted(knots, stretches, side="right")]

    def _integral(self, stretches: NDArray[np.float64]) -> NDArray[np.float64]:
        """(m,) of f from the first stretch of the curve on."""
        knots, values = self.curve
        sums = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(knots))])
        at = np.clip(np.searchsorted(knots, stretches, side="right") - 1, 0, len(knots) - 1)
        return sums[at] + 0.5 * (values[at] + self.share(stretches)) * (stretches - knots[at])
