"""The objective of a step: one sum of potentials, in any order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from supple.solvers.implicit.energies.potential import HessianBlocks, Potential
from supple.solvers.implicit.newton.hessian_projection import ProjectedTerms
from supple.solvers.implicit.timings import Clock

# The labels of contact and of joints: so stiff that a short Newton step can leave large forces.
_STIFF = ("contact", "joints")


@dataclass(frozen=True, eq=False)
class Model:
    """The objective near one point.

    Attributes
    ----------
    positions : (n, 3) [m]; energy : [J]; size : sum of the absolute values of the energy's terms [J]
    gradient : (n, 3) [N]
    """

    positions: NDArray[np.float64]
    energy: float
    size: float
    gradient: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Objective:
    """The sum of its terms, each an energy [J]."""

    terms: Sequence[Potential]
    clock: Clock = field(default_factory=Clock)

    def value(self, x: NDArray[np.float64]) -> float:
        return self.value_and_size(x)[0]

    def value_and_size(self, x: NDArray[np.float64]) -> tuple[float, float]:
        """The energy, and the sum of the terms' absolute values: round-off in the first is relative to the second."""
        values = []
        for term in self.terms:
            with self.clock.of(term.label):
                values.append(term.value(x))
        return sum(values), sum(abs(value) for value in values)

    def contact_gradient(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(n, 3) of contact and joints alone [N]."""
        return _gradient([term for term in self.terms if term.label in _STIFF], x)

    def gradient(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(n, 3) [N]."""
        return _gradient(self.terms, x)

    def renew(self, x: NDArray[np.float64], direction: NDArray[np.float64]) -> None:
        """Renew the duals of all terms after a direction (n, 3) that was found at x (n, 3)."""
        for term in self.terms:
            with self.clock.of(term.label):
                term.renew(x, direction)

    def model(
        self, x: NDArray[np.float64], hessian: HessianBlocks | None, projected: ProjectedTerms = ProjectedTerms.ALL
    ) -> Model:
        """Energy and gradient at x; the Hessian with some terms projected into `hessian`, where that is given."""
        gradient = np.zeros_like(x)
        if hessian is not None:
            hessian.clear()
        values = []
        for term in self.terms:
            with self.clock.of(term.label):
                values.append(term.add_model(x, gradient, hessian, projected.includes(term.projection)))
        return Model(x, sum(values), sum(abs(value) for value in values), gradient)


def _gradient(terms: Sequence[Potential], x: NDArray[np.float64]) -> NDArray[np.float64]:
    out = np.zeros_like(x)
    for term in terms:
        term.add_gradient(x, out)
    return out
