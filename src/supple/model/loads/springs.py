"""Springs between two points, each an affine combination of four vertices, or fixed in the world."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from supple.model.loads.applied import AppliedLoad


@dataclass(frozen=True, eq=False)
class PointSpring(AppliedLoad):
    """One spring, k / 2 (l - l0)^2 with l = |r|, r = sum c_i x_i + offset.

    Attributes
    ----------
    vertices : (v,) all different; coefficients : (v,), those of the first end minus those of the second
    offset : (3,) of ends that are fixed in the world [m]
    stiffness : k [N/m]; rest_length : time -> l0 [m]
    """

    vertices: NDArray[np.int32]
    coefficients: NDArray[np.float64]
    offset: NDArray[np.float64]
    stiffness: float
    rest_length: Callable[[float], float]

    work = "springs"

    @property
    def is_anchored(self) -> bool:
        """Whether an end is fixed in the world: the coefficients then do not add up to zero."""
        return abs(float(self.coefficients.sum())) > 0.5

    def renumbered(self, new: NDArray[np.int32]) -> PointSpring:
        return replace(self, vertices=new[self.vertices])

    def acts_on(self) -> NDArray[np.int32]:
        return self.vertices

    def add_forces(self, x: NDArray[np.float64], time: float, out: NDArray[np.float64]) -> None:
        length, along = self.length(x)
        pull = -self.stiffness * (length - self.rest_length(time)) * along
        out[self.vertices] += self.coefficients[:, None] * pull

    def length(self, x: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        """l [m] and the unit vector r / l; zero where the ends coincide."""
        r = self.coefficients @ x[self.vertices] + self.offset
        length = float(np.sqrt(r @ r))
        return length, r / length if length > 0.0 else np.zeros(3)

    def energy(self, x: NDArray[np.float64], time: float) -> float:
        """[J]"""
        return 0.5 * self.stiffness * (self.length(x)[0] - self.rest_length(time)) ** 2
