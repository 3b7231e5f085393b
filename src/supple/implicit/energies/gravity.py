"""Gravity as a potential: -m g . x."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.implicit.energies.potential import HessianBlocks, Potential, Projection


@dataclass(frozen=True, eq=False)
class Gravity(Potential):
    """Uniform gravity.

    Parameters
    ----------
    masses : (n,) [kg]; acceleration : (3,) [m/s^2]
    origin : (n, 3) where the energy is zero [m]; near x, so that no digits are lost
    """

    masses: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    origin: NDArray[np.float64]
    projection = Projection.UNNEEDED

    def value(self, x: NDArray[np.float64]) -> float:
        return -float((self.masses @ (x - self.origin)) @ self.acceleration)

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        out -= self.masses[:, None] * self.acceleration

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        """Zero."""
