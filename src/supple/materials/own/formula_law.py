"""The law of an energy that is given as text, evaluated with arrays: what recordings keep.

Nothing is compiled, and derivatives are not those of SymPy: with complex numbers,

    d psi / dx = Im psi(x + i h) / h + O(h^2),

is exact to round-off for h = 1e-30, since nothing is subtracted (Squire, Trapp, "Using complex variables to estimate
derivatives of real functions", 1998). So a check of a recording does not depend on what has computed it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.materials.own.derivation import compiled_law
from supple.materials.own.formula import VARIABLES, Formula
from supple.materials.per_tet import Law

_h = 1e-30


@dataclass(frozen=True, eq=False)
class FormulaLaw(Law):
    """psi plus K/2 (J - 1)^2; parameters are K, then those of the formula, which is zero at rest."""

    formula: Formula
    bulk: int | None = 0

    @property
    def counts(self) -> range:  # pyright: ignore[reportIncompatibleVariableOverride]
        count = 1 + len(self.formula.parameters)
        return range(count, count + 1)

    def densities(self, F: NDArray[np.float64], p: NDArray[np.float64]) -> NDArray[np.float64]:
        J = np.linalg.det(F)
        psi = self.formula.densities(_variables(F, self.formula.of), p[:, 1:])
        return np.where(J > 0.0, psi + 0.5 * p[:, 0] * (J - 1.0) ** 2, np.inf)

    def models(
        self, F: NDArray[np.float64], p: NDArray[np.float64], second: bool, project: bool
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        if second:
            of = self.formula
            return compiled_law(of.expression(), of.of, of.parameters).models(F, p, second, project)
        J = np.linalg.det(F)
        x = _variables(F, self.formula.of)
        slopes = []
        for k in range(3):
            moved = tuple(value + 1j * _h * (i == k) for i, value in enumerate(x))
            slopes.append(np.imag(self.formula.densities(moved, p[:, 1:])) / _h)
        with np.errstate(all="ignore"):
            cofactor = J[:, None, None] * np.swapaxes(
                np.linalg.inv(np.where(J[:, None, None] > 0.0, F, np.eye(3))), 1, 2
            )
        P = (p[:, 0] * (J - 1.0))[:, None, None] * cofactor
        if self.formula.of == "invariants":
            by_I1, by_I2, by_J = (slope[:, None, None] for slope in slopes)
            C = np.swapaxes(F, 1, 2) @ F
            P += 2.0 * by_I1 * F + 2.0 * by_I2 * (x[0][:, None, None] * F - F @ C) + by_J * cofactor
        else:
            U, _, Vt = np.linalg.svd(F)
            P += U @ (np.stack(slopes, axis=1)[:, :, None] * Vt)
        P[~(J > 0.0)] = np.nan
        return self.densities(F, p), P, np.zeros((0, 9, 9))


def _variables(F: NDArray[np.float64], of: str) -> tuple[NDArray[np.float64], ...]:
    """Three arrays (k,), those of `VARIABLES`."""
    assert of in VARIABLES
    if of == "stretches":
        return tuple(np.linalg.svd(F, compute_uv=False).T)
    C = np.swapaxes(F, 1, 2) @ F
    I1 = np.trace(C, axis1=1, axis2=2)
    return I1, 0.5 * (I1**2 - np.einsum("kij,kji->k", C, C)), np.linalg.det(F)
