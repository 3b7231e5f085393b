"""Forces that act within a step instead of at its end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.solvers.implicit.energies.potential import HessianBlocks, Potential, Wrapped


@dataclass(frozen=True, eq=False)
class ActingWithin(Wrapped):
    """A potential V whose force acts at x_n + p (x - x_n), as a potential V / p^2 of the end x of the step.

    Its gradient is grad V / p, and its Hessian is that of V. The factor 1 / p of the force is that of the whole
    objective, see `Plan`.

    Parameters
    ----------
    inner : V; start : x_n (n, 3) [m]; place : p, above 0 and at most 1
    """

    inner: Potential
    start: NDArray[np.float64]
    place: float

    def value(self, x: NDArray[np.float64]) -> float:
        return self.inner.value(self._within(x)) / self.place**2

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        gradient = np.zeros_like(out)
        self.inner.add_gradient(self._within(x), gradient)
        out += gradient / self.place

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        self.inner.add_hessian(self._within(x), out, project)

    def add_model(
        self, x: NDArray[np.float64], gradient: NDArray[np.float64], hessian: HessianBlocks | None, project: bool
    ) -> float:
        own = np.zeros_like(gradient)
        value = self.inner.add_model(self._within(x), own, hessian, project)
        gradient += own / self.place
        return value / self.place**2

    def renew(self, x: NDArray[np.float64], direction: NDArray[np.float64]) -> None:
        self.inner.renew(self._within(x), self.place * direction)

    def _within(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.start + self.place * (x - self.start)
