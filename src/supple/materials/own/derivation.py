"""From a formula of psi to a compiled law: derivatives by SymPy, machine code by Numba.

SymPy differentiates the formula and prints it with all derivatives as one Python function of numbers, with common
subexpressions computed once (`lambdify` with `cse`); Numba compiles that function and what turns it into derivatives by
the principal logarithmic strains e_i (see `supple.materials.laws.log_strains`).

With a_i = s_i^2, u_i = 2 a_i = dI1/de_i and v_i = 2 a_i (I1 - a_i) = dI2/de_i, an energy W(I1, I2, J) has

    tau_i = W1 u_i + W2 v_i + WJ J,    b_ij = (2 W1 + 2 W2 a_k) (a_i - a_j) / (e_i - e_j).

An energy of the stretches has tau_i = s_i psi_i. Where two stretches differ, b_ij is the difference quotient; where
they are close, the mean of (c_ii - 2 c_ij + c_jj) / 2 over the way between them, by Gauss' rule with three points.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numba.np.unsafe import ndarray
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.materials.laws.isotropic_law import IsotropicLaw
from supple.materials.laws.log_strains import exp_quotient, law_kernel, log_strains
from supple.materials.own.formula import VARIABLES, Formula, symbols_of
from supple.materials.stretch_energies.stretches import volume_change
from supple.runtime.kernel_cache import njit

to_fixed_tuple: Any = ndarray.to_fixed_tuple  # of an array, for a number of entries that the compiler knows
_GAUSS = 0.5 * math.sqrt(0.6)


def expression_of(psi: Callable[..., Any] | str, of: str, names: tuple[str, ...]) -> Any:
    """The formula that `psi` computes or is, as an expression of SymPy, zero at rest.

    Raises
    ------
    SceneError : where it cannot be called with symbols, or is not a formula of them.
    """
    symbols = symbols_of(of, names)
    import sympy

    variables = [symbols[name] for name in VARIABLES[of]]
    rest = dict(zip(variables, (3.0, 3.0, 1.0) if of == "invariants" else (1.0, 1.0, 1.0), strict=True))
    if isinstance(psi, str):
        try:
            formula = Formula(psi, of, names).expression()
        except SceneError as error:
            raise SceneError(f"EnergyMaterial: {error}") from None
        return formula - formula.subs(rest)
    try:
        formula = sympy.sympify(psi(*variables, **{name: symbols[name] for name in names}))
    except Exception as error:  # whatever the user's function raises
        reason = " ".join(str(error).split()) or type(error).__name__
        raise SceneError(
            f"EnergyMaterial: psi cannot be called with symbols ({reason}); use +, -, *, /, ** and functions of sympy"
        ) from None
    unknown = getattr(formula, "free_symbols", None)
    if unknown is None or not isinstance(formula, sympy.Expr):
        raise SceneError(f"EnergyMaterial: psi returns a {type(formula).__name__}; return one formula")
    return formula - formula.subs(rest)


@lru_cache(maxsize=64)
def derivatives(expression: Any, of: str, names: tuple[str, ...]) -> Any:
    """A Python function of the variables and the parameters with these names: psi, its three first derivatives, and its
    six second ones in the order 00, 11, 22, 12, 02, 01; of stretches those by their logarithms."""
    import sympy

    symbols = symbols_of(of, names)
    variables, values = ([symbols[name] for name in group] for group in (VARIABLES[of], names))
    if of == "invariants":
        first = [sympy.diff(expression, symbol) for symbol in variables]
        second = [sympy.diff(first[i], variables[j]) for i, j in ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))]
    else:
        first = [symbol * sympy.diff(expression, symbol) for symbol in variables]
        second = [
            variables[j] * sympy.diff(first[i], variables[j])
            for i, j in ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
        ]
    outputs = tuple(sympy.N(output, 17) for output in (expression, *first, *second))
    return sympy.lambdify((*variables, *values), outputs, "math", cse=True)


def stress_at_rest(expression: Any, of: str, parameters: dict[str, float]) -> float:
    """d psi / d s_0 at rest [Pa]."""
    function = derivatives(expression, of, tuple(parameters))
    if of == "stretches":
        return float(function(1.0, 1.0, 1.0, *parameters.values())[1])
    _, by_I1, by_I2, by_J, *_ = function(3.0, 3.0, 1.0, *parameters.values())
    return float(2.0 * by_I1 + 4.0 * by_I2 + by_J)


def moduli_at_rest(expression: Any, of: str, names: tuple[str, ...], rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k, 2) shear and bulk modulus [Pa] of rows of parameters (k, q); nothing is compiled."""
    function = derivatives(expression, of, names)
    different, which = np.unique(rows, axis=0, return_inverse=True)
    moduli = []
    for row in different.tolist():
        if of == "stretches":
            values = [float(value) for value in function(1.0, 1.0, 1.0, *row)]
            mu, lam = 0.5 * (values[4] - values[7]), values[7]
        else:
            values = [float(value) for value in function(3.0, 3.0, 1.0, *row)]
            _, W1, W2, WJ, h11, h22, hJJ, h2J, h1J, h12 = values
            mu = 2.0 * (W1 + W2)
            lam = 4.0 * W2 + 4.0 * h11 + 16.0 * h12 + 16.0 * h22 + 4.0 * h1J + 8.0 * h2J + hJJ + WJ
        moduli.append((mu, lam + 2.0 * mu / 3.0))
    return np.array(moduli)[which.ravel()]


@dataclass(frozen=True, eq=False)
class OwnLaw(IsotropicLaw):
    """The law of an energy that a user gives. formula : as recordings have it; None where it cannot be a text"""

    formula: Formula | None = None


@lru_cache(maxsize=64)
def compiled_law(expression: Any, of: str, names: tuple[str, ...]) -> OwnLaw:
    """The law of an expression of SymPy; its parameters are K of K/2 (J - 1)^2, and those with these names."""
    function = njit(derivatives(expression, of, names))
    name = f"own_{abs(hash((expression, of, names)))}"
    energy = _energy_of_invariants if of == "invariants" else _energy_of_stretches
    return OwnLaw(
        law_kernel(name, energy(function, len(names)), cache=False),
        range(1 + len(names), 2 + len(names)),
        bulk=0,
        formula=Formula.of_expression(expression, of, names),
    )


def _energy_of_invariants(function: Any, count: int) -> Any:
    @njit
    def energy(s, p):
        e, _ = log_strains(s)
        a, b, c = s[0] * s[0], s[1] * s[1], s[2] * s[2]
        J = s[0] * s[1] * s[2]
        u = (2.0 * a, 2.0 * b, 2.0 * c)
        v = (2.0 * a * (b + c), 2.0 * b * (a + c), 2.0 * c * (a + b))
        f = function(a + b + c, a * b + b * c + c * a, J, *to_fixed_tuple(p[1:], count))
        W1, W2, WJ = float(f[1]), float(f[2]), float(f[3])
        h11, h22, hJJ, h2J, h1J, h12 = float(f[4]), float(f[5]), float(f[6]), float(f[7]), float(f[8]), float(f[9])
        # Coefficients of u_i, v_i and J in the derivative of tau_i by e_j, for every j.
        x = (h11 * u[0] + h12 * v[0] + h1J * J, h11 * u[1] + h12 * v[1] + h1J * J, h11 * u[2] + h12 * v[2] + h1J * J)
        y = (h12 * u[0] + h22 * v[0] + h2J * J, h12 * u[1] + h22 * v[1] + h2J * J, h12 * u[2] + h22 * v[2] + h2J * J)
        z = (
            (h1J * u[0] + h2J * v[0] + hJJ * J + WJ) * J,
            (h1J * u[1] + h2J * v[1] + hJJ * J + WJ) * J,
            (h1J * u[2] + h2J * v[2] + hJJ * J + WJ) * J,
        )
        tau = (W1 * u[0] + W2 * v[0] + WJ * J, W1 * u[1] + W2 * v[1] + WJ * J, W1 * u[2] + W2 * v[2] + WJ * J)
        tangent = (
            2.0 * (W1 * u[0] + W2 * v[0]) + x[0] * u[0] + y[0] * v[0] + z[0],
            2.0 * (W1 * u[1] + W2 * v[1]) + x[1] * u[1] + y[1] * v[1] + z[1],
            2.0 * (W1 * u[2] + W2 * v[2]) + x[2] * u[2] + y[2] * v[2] + z[2],
            W2 * u[1] * u[2] + x[2] * u[1] + y[2] * v[1] + z[2],
            W2 * u[0] * u[2] + x[2] * u[0] + y[2] * v[0] + z[2],
            W2 * u[0] * u[1] + x[1] * u[0] + y[1] * v[0] + z[1],
        )
        x0, x1, x2 = 2.0 * e[0], 2.0 * e[1], 2.0 * e[2]
        q = (
            4.0 * (W1 + W2 * a) * exp_quotient(x1, x2, b - 1.0, c - 1.0),
            4.0 * (W1 + W2 * b) * exp_quotient(x0, x2, a - 1.0, c - 1.0),
            4.0 * (W1 + W2 * c) * exp_quotient(x0, x1, a - 1.0, b - 1.0),
        )
        return _with_volume(s, float(f[0]), tau, tangent, q, p[0])

    return energy


def _energy_of_stretches(function: Any, count: int) -> Any:
    @njit
    def stiffness(s, p, i, j):
        """(c_ii - 2 c_ij + c_jj) / 2."""
        f = function(s[0], s[1], s[2], *to_fixed_tuple(p[1:], count))
        c = (float(f[4]), float(f[5]), float(f[6]))
        pair = (float(f[7]), float(f[8]), float(f[9]))
        return 0.5 * (c[i] + c[j]) - pair[3 - i - j]

    @njit
    def quotient(s, e, tau, p, i, j):
        half = 0.5 * (e[i] - e[j])
        if abs(half) > 0.01:
            return 0.5 * (tau[i] - tau[j]) / half
        middle, k, total = 0.5 * (e[i] + e[j]), 3 - i - j, 0.0
        for n in range(3):
            place = (0.5 - _GAUSS, 0.5, 0.5 + _GAUSS)[n]
            x, y = math.exp(middle + place * half), math.exp(middle - place * half)
            between = (
                x if i == 0 else (y if j == 0 else s[k]),
                x if i == 1 else (y if j == 1 else s[k]),
                x if i == 2 else (y if j == 2 else s[k]),
            )
            total += (5.0, 8.0, 5.0)[n] / 18.0 * stiffness(between, p, i, j)
        return total

    @njit
    def energy(s, p):
        e, _ = log_strains(s)
        f = function(s[0], s[1], s[2], *to_fixed_tuple(p[1:], count))
        tau = (float(f[1]), float(f[2]), float(f[3]))
        tangent = (float(f[4]), float(f[5]), float(f[6]), float(f[7]), float(f[8]), float(f[9]))
        q = (quotient(s, e, tau, p, 1, 2), quotient(s, e, tau, p, 0, 2), quotient(s, e, tau, p, 0, 1))
        return _with_volume(s, float(f[0]), tau, tangent, q, p[0])

    return energy


@njit
def _with_volume(s, psi, tau, c, b, bulk):
    """An energy and its derivatives with bulk/2 (J - 1)^2 added."""
    j = volume_change(s)
    J = 1.0 + j
    p, k = bulk * j * J, bulk * J * (j + J)
    return (
        psi + 0.5 * bulk * j * j,
        (tau[0] + p, tau[1] + p, tau[2] + p),
        (c[0] + k, c[1] + k, c[2] + k, c[3] + k, c[4] + k, c[5] + k),
        b,
    )
