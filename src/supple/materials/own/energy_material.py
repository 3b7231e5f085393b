"""Materials with an energy that a user gives as a Python function."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from itertools import permutations
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.validators import NON_NEGATIVE, Choice, NumberPerTet, Validator
from supple.materials.by_law import ByLaw
from supple.materials.material import Material, NotRecorded
from supple.materials.own.derivation import (
    OwnLaw,
    compiled_law,
    derivatives,
    expression_of,
    moduli_at_rest,
    stress_at_rest,
)
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


@dataclass(frozen=True)
class FormulaText(Validator):
    """A formula as a text, or a function of symbols."""

    def checked(self, value: Any, what: str) -> Any:
        if not callable(value) and not isinstance(value, str | Formula):
            raise SceneError(f"{what} is a {type(value).__name__}; give a formula or a function")
        return value


@dataclass(frozen=True)
class NamedNumbers(Validator):
    """Finite numbers by name, each one or one per tetrahedron."""

    def checked(self, value: Any, what: str) -> Any:
        for name, given in value.items():
            try:
                good = np.isfinite(np.asarray(given, dtype=np.float64)).all()
            except (TypeError, ValueError):
                good = False
            if not good:
                raise SceneError(f"EnergyMaterial: the parameter {name!r} is {given!r}; give finite numbers")
        return {name: np.asarray(given) if np.ndim(given) else given for name, given in value.items()}


@dataclass(frozen=True, eq=False, kw_only=True)
class EnergyMaterial(ByLaw):
    """An isotropic material with an energy of one's own: psi plus K/2 (J - 1)^2.

    SymPy differentiates the formula that `psi` is, or that it returns when it is called with symbols, and Numba
    compiles all of it.

    Parameters
    ----------
    psi : energy per rest volume [Pa]; a constant in it is taken away. Either a text with the three variables and the
        `parameters` by name, numbers, + - * / ** and exp, log, sqrt, sin, sinh or another such function; or a function
        of three variables and of all `parameters` by name, made of +, -, *, /, ** and functions of SymPy.
    of : "invariants", then the variables are I1 = tr C, I2 = (I1^2 - tr C^2) / 2 and J = det F; or "stretches", then
        they are the principal stretches, in which psi must be symmetric.
    parameters : by name; one number each, or one per tetrahedron, in the units of the formula [SI].
    bulk : K [Pa], zero or more. Quadratic tets average the volume of this part alone.

    Raises
    ------
    SceneError : where psi is not such a formula, is not symmetric in the stretches, or has a stress at rest.
    """

    psi: Annotated[Callable[..., Any] | str, FormulaText()]
    of: Annotated[str, Choice(tuple(VARIABLES))] = "invariants"
    parameters: Annotated[Mapping[str, float | NDArray[np.float64]], NamedNumbers()] = field(default_factory=dict)
    bulk: Annotated[float | NDArray[np.float64], NumberPerTet(NON_NEGATIVE)] = 0.0
    formula: str = field(init=False, default="")

    shear_formula = "that of psi"

    def recorded(self) -> Material:
        """The same with its formula as text, which needs neither SymPy nor a compiler to be read."""
        formula = getattr(self.law(), "formula", None)
        if formula is None:
            return NotRecorded(name=type(self).__name__, density=self.density, damping=self.damping)
        return self if self.psi is formula else replace(self, psi=formula)

    def _check(self) -> None:
        if isinstance(self.psi, Formula):
            if (self.psi.of, self.psi.parameters) != (self.of, self._names):
                raise SceneError("EnergyMaterial: psi is a formula of other variables or parameters")
            object.__setattr__(self, "formula", self.psi.text)
            object.__setattr__(self, "_law", FormulaLaw(self.psi))
            return
        expression = expression_of(self.psi, self.of, self._names)
        object.__setattr__(self, "formula", str(expression))
        object.__setattr__(self, "_expression", expression)
        self._check_rest(expression)
        object.__setattr__(self, "_law", compiled_law(expression, self.of, self._names))

    def _check_rest(self, expression: Any) -> None:
        """Before anything is compiled."""
        values = {name: float(np.ravel(np.asarray(value))[0]) for name, value in self.parameters.items()}
        function = derivatives(expression, self.of, self._names)
        try:
            stress = stress_at_rest(expression, self.of, values)
            rest = function(*((3.0, 3.0, 1.0) if self.of == "invariants" else (1.0, 1.0, 1.0)), *values.values())
            orders = permutations((1.2, 0.9, 1.1)) if self.of == "stretches" else ()
            stretched = [float(function(*s, *values.values())[0]) for s in orders]
        except (ArithmeticError, ValueError, TypeError):
            raise SceneError("EnergyMaterial: psi or a derivative of it is not finite near rest") from None
        if not np.isfinite([stress, *rest]).all():
            raise SceneError("EnergyMaterial: psi or a derivative of it is not finite near rest")
        if abs(stress) > 1e-9 * max(abs(float(item)) for item in rest[1:]):
            raise SceneError(
                f"EnergyMaterial: psi has a stress of {stress:g} Pa at rest; add a term that cancels it, such as a "
                "multiple of log(J)"
            )
        if stretched and np.ptp(stretched) > 1e-9 * np.abs(stretched).max():
            raise SceneError("EnergyMaterial: psi is not symmetric in the stretches; use all three alike")

    @property
    def _names(self) -> tuple[str, ...]:
        return tuple(self.parameters)

    def rest_moduli(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        columns = np.broadcast_arrays(*(np.asarray(value, dtype=np.float64) for _, value in self.law_parameters()))
        rows = np.column_stack([np.ravel(column) for column in columns])
        if isinstance(self.psi, Formula):
            mu, bulk = self._measured_moduli(rows)
            return (mu, bulk) if columns[0].ndim else (mu[0], bulk[0])
        expression: Any = self._expression  # pyright: ignore[reportAttributeAccessIssue]
        try:
            mu, bulk = moduli_at_rest(expression, self.of, self._names, rows[:, 1:]).T
        except (ArithmeticError, ValueError, TypeError):
            raise SceneError("EnergyMaterial: psi or a derivative of it is not finite near rest") from None
        bulk = bulk + rows[:, 0]
        return (mu, bulk) if columns[0].ndim else (mu[0], bulk[0])

    def _measured_moduli(self, rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """(2, k) from stresses of small shears and dilations: differences of fourth order."""
        E, stresses = np.eye(3), []
        for part, factor in ((np.outer(E[0], E[1]) + np.outer(E[1], E[0]), 8.0), (E, 18.0)):
            slopes = []
            for strain in (5e-4, 1e-3):
                ends = (np.tile(E + sign * strain * part, (len(rows), 1, 1)) for sign in (1.0, -1.0))
                more, less = (self.law().models(F, rows, False, False)[1] for F in ends)
                slopes.append(np.einsum("kij,ij->k", more - less, part) / (factor * strain))
            stresses.append((4.0 * slopes[0] - slopes[1]) / 3.0)
        return np.array(stresses)

    def law(self) -> OwnLaw | FormulaLaw:
        return self._law  # pyright: ignore[reportAttributeAccessIssue]

    def law_parameters(self) -> tuple[tuple[str, ArrayLike], ...]:
        return (("bulk", self.bulk), *self.parameters.items())
