"""Prevents the inversion of quadratic tets anywhere in them: how far a step may go, and the check after it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic_tets.quadratic import QuadraticTets
from supple.numerics.bernstein import positive_coefficients, positive_elements
from supple.numerics.quadratic_noninverting_step import noninverting_step
from supple.runtime.kernel_cache import read_only
from supple.runtime.threads import threads_for
from supple.solvers.implicit.energies.quadratic.term import SERIAL_ELEMENTS


@dataclass(frozen=True, eq=False)
class QuadraticGuard:
    """The step filter on quadratic tets.

    Attributes
    ----------
    by_coefficients : (k,) where all Bernstein coefficients of the determinant are positive at the start of a step, and
        at rest. They have a barrier and stay positive. In the other elements, which are strongly curved, the
        determinant itself is kept positive.
    """

    tets: QuadraticTets
    by_coefficients: NDArray[np.bool_]

    @classmethod
    def at(cls, tets: QuadraticTets, x: NDArray[np.float64]) -> QuadraticGuard:
        """For a step from x (n, 3)."""
        here = np.empty(len(tets.rows), dtype=np.bool_)
        with threads_for(len(here), SERIAL_ELEMENTS):
            positive_coefficients(x, tets.nodes, here)
        return cls(tets, here & (tets.rest_coefficients > 0.0).all(axis=1))

    def largest_step(
        self, x: NDArray[np.float64], direction: NDArray[np.float64], guarded: NDArray[np.bool_], keep: float
    ) -> tuple[float, int]:
        """The largest step for the `guarded` (k,) elements, and which of all tets limits it (-1 where none does)."""
        with threads_for(len(guarded), SERIAL_ELEMENTS):
            step, k = noninverting_step(x, direction, self.tets.nodes, guarded, self.by_coefficients, keep)
        return float(step), -1 if k < 0 else int(self.tets.rows[k])

    def allows(self, x: NDArray[np.float64], guarded: NDArray[np.bool_]) -> bool:
        """Whether all guarded elements are positive everywhere at x."""
        positive = np.empty(len(guarded), dtype=np.bool_)
        with threads_for(len(guarded), SERIAL_ELEMENTS):
            positive_coefficients(x, self.tets.nodes, positive)
        if (positive | ~guarded).all():
            return True
        if (guarded & self.by_coefficients & ~positive).any():
            return False
        return bool((are_positive(self.tets, x) | ~guarded).all())


def are_positive(tets: QuadraticTets, x: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(k,) whether J is positive everywhere in a quadratic tet."""
    positive = np.empty(len(tets.rows), dtype=np.bool_)
    with threads_for(len(positive), SERIAL_ELEMENTS):
        positive_elements(read_only(x), read_only(tets.nodes), positive)
    return positive
