"""Energies as text: read without executing anything, evaluated with arrays or symbols, written from SymPy.

Python's parser reads the text. Of its tree only numbers, names, the signs + - * / ** and calls of `FUNCTIONS` have a
value here; everything else is refused. What is made of numbers alone is computed with fractions and floats, so that no
power of numbers takes long.
"""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError

VARIABLES = {"invariants": ("I1", "I2", "J"), "stretches": ("s0", "s1", "s2")}
FUNCTIONS: dict[str, Callable[..., Any]] = {
    "exp": np.exp, "log": np.log, "sqrt": np.sqrt,
    "sin": np.sin, "cos": np.cos, "tan": np.tan, "asin": np.arcsin, "acos": np.arccos, "atan": np.arctan,
    "sinh": np.sinh, "cosh": np.cosh, "tanh": np.tanh, "asinh": np.arcsinh, "acosh": np.arccosh, "atanh": np.arctanh,
}  # fmt: skip
_CONSTANTS = {"pi": float(np.pi), "E": float(np.e)}
_SIGNS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
_LONGEST, _DEEPEST = 4000, 200
_LARGEST_EXPONENT = 100
_EXACT = 2**64


@dataclass(frozen=True)
class Formula:
    """An energy per rest volume as text.

    Parameters
    ----------
    text : made of the variables, of the parameters, numbers, + - * / ** and `FUNCTIONS`
    of : whose energy it is, a key of `VARIABLES`; parameters : their names, in the order of rows of parameters

    Raises
    ------
    SceneError : where it is anything else.
    """

    text: str
    of: str
    parameters: tuple[str, ...]

    def __post_init__(self) -> None:
        for name in self.parameters:
            if not name.isidentifier() or name in VARIABLES[self.of]:
                raise SceneError(f"the parameter {name[:40]!r} cannot be in a formula; give it another name")
        names = (*VARIABLES[self.of], *self.parameters)
        self.evaluated(dict.fromkeys(names, np.ones(1)), FUNCTIONS, float)

    def evaluated(
        self, values: Mapping[str, Any], functions: Mapping[str, Callable[..., Any]], number: Callable[[Any], Any]
    ) -> Any:
        """The value with those of the names, which may be arrays or symbols.

        Parameters
        ----------
        functions : of such values, by the names of `FUNCTIONS`
        number : makes such a value of a `Fraction` or a float
        """
        with np.errstate(all="ignore"):
            text = self.text.strip()
            value = _Evaluation(text, values, functions, number).of(_parsed(text), 0)
        return number(value) if isinstance(value, Fraction | float) else value

    def densities(self, variables: tuple[NDArray[np.generic], ...], p: NDArray[np.float64]) -> NDArray[Any]:
        """(k,) of arrays (k,) of the variables, which may be complex, and parameters p (k, q)."""
        names = (*VARIABLES[self.of], *self.parameters)
        values = dict(zip(names, (*variables, *p.T), strict=True))
        return np.zeros(len(p)) + self.evaluated(values, FUNCTIONS, float)

    def expression(self) -> Any:
        """The formula of SymPy, of positive variables and real parameters."""
        symbols = symbols_of(self.of, self.parameters)
        import sympy

        def number(value: Any) -> Any:
            return sympy.Rational(*value.as_integer_ratio()) if isinstance(value, Fraction) else sympy.Float(value)

        functions = {name: getattr(sympy, name) for name in FUNCTIONS}
        return sympy.sympify(self.evaluated(symbols, functions, number))

    @classmethod
    def of_expression(cls, expression: Any, of: str, parameters: tuple[str, ...]) -> Formula | None:
        """The formula of SymPy as text; None where it contains what texts cannot."""
        from sympy.printing.str import StrPrinter

        class Exact(StrPrinter):
            def _print_Float(self, expr: Any) -> str:  # SymPy's own prints 15 digits
                return repr(float(expr))

        try:
            return cls(Exact().doprint(expression), of, parameters)
        except SceneError:
            return None


def symbols_of(of: str, parameters: tuple[str, ...]) -> dict[str, Any]:
    """SymPy's symbols of the variables and of the parameters, by name.

    Raises
    ------
    SceneError : where SymPy is not installed.
    """
    try:
        import sympy
    except ModuleNotFoundError:
        raise SceneError("EnergyMaterial needs SymPy, which is not installed; pip install 'supple[symbolic]'") from None

    variables = {name: sympy.Symbol(name, positive=True) for name in VARIABLES[of]}
    return variables | {name: sympy.Symbol(name, real=True) for name in parameters}


def _parsed(text: str) -> ast.expr:
    if len(text) > _LONGEST:
        raise SceneError(f"the formula has {len(text)} characters; give at most {_LONGEST}")
    try:
        return ast.parse(text, mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise SceneError(f"the formula {text[:60]!r} cannot be read; write it as in Python") from None


@dataclass(frozen=True)
class _Evaluation:
    text: str
    values: Mapping[str, Any]
    functions: Mapping[str, Callable[..., Any]]
    number: Callable[[Any], Any]

    def of(self, node: ast.expr, depth: int) -> Any:
        """The value of a part; a `Fraction` or a float where it is made of numbers alone."""
        if depth > _DEEPEST:
            raise SceneError("the formula is nested too deeply; give parts of it as parameters")
        match node:
            case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
                return _finite(value if isinstance(value, float) else Fraction(value))
            case ast.Name(id=name) if name in self.values:
                return self.values[name]
            case ast.Name(id=name) if name in _CONSTANTS:
                return _CONSTANTS[name]
            case ast.Name(id=name):
                raise SceneError(f"the formula has the unknown name {name[:40]!r}; there are {', '.join(self.values)}")
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                return -self.of(inner, depth + 1)
            case ast.UnaryOp(op=ast.UAdd(), operand=inner):
                return self.of(inner, depth + 1)
            case ast.BinOp(left=left, op=sign, right=right) if type(sign) in _SIGNS:
                return self._joined(type(sign), self.of(left, depth + 1), self.of(right, depth + 1))
            case ast.Call(func=ast.Name(id=name), args=[inner], keywords=[]) if name in FUNCTIONS:
                argument = self.of(inner, depth + 1)
                if isinstance(argument, Fraction | float):
                    return _finite(float(FUNCTIONS[name](float(argument))))
                return self.functions[name](argument)
        part = (ast.get_source_segment(self.text, node) or "")[:60]
        raise SceneError(
            f"the formula has {part!r}; use numbers, names, + - * / **, parentheses and {', '.join(FUNCTIONS)}"
        )

    def _joined(self, sign: type, left: Any, right: Any) -> Any:
        constant = [isinstance(side, Fraction | float) for side in (left, right)]
        if all(constant):
            return _of_numbers(sign, left, right)
        if sign is ast.Pow and constant[1] and abs(right) > _LARGEST_EXPONENT:
            raise SceneError(f"the formula has the exponent {float(right):g}; give one up to {_LARGEST_EXPONENT}")
        left, right = (
            self.number(side) if known else side for side, known in zip((left, right), constant, strict=True)
        )
        return _SIGNS[sign](left, right)


def _of_numbers(sign: type, left: Fraction | float, right: Fraction | float) -> Fraction | float:
    exact = isinstance(left, Fraction) and isinstance(right, Fraction)
    if sign is ast.Pow:
        exact = exact and right.as_integer_ratio()[1] == 1 and abs(right) <= _LARGEST_EXPONENT
    try:
        return _finite(_SIGNS[sign](left, right) if exact else _SIGNS[sign](float(left), float(right)))
    except (ArithmeticError, TypeError):
        raise SceneError("the formula has a number that is not finite; give another") from None


def _finite(value: Any) -> Fraction | float:
    """A number, as a fraction while it is short."""
    try:
        if isinstance(value, Fraction) and max(abs(value.numerator), value.denominator) < _EXACT:
            return value
        number = float(value)
    except (OverflowError, TypeError):
        number = np.inf
    if not np.isfinite(number):
        raise SceneError("the formula has a number that is not finite; give another")
    return number
