"""Values with units, as a person reads and types them: "30 kPa"."""

from __future__ import annotations

import math
import re

from supple.app.viewer.protocol.values import displayed
from supple.errors import CommandError

_PREFIXES = {"n": 1e-9, "µ": 1e-6, "u": 1e-6, "m": 1e-3, "k": 1e3, "M": 1e6, "G": 1e9}
_WRITTEN = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
# Units that are written with a prefix.
WITH_PREFIX = ("Pa", "N", "m", "s", "J", "J/m^3")
_ALSO = {"kg/m^3": {"g/cm^3": 1e3}, "m": {"cm": 1e-2}}
_POWERS = str.maketrans({"²": "^2", "³": "^3", "⁵": "^5"})
_TYPED = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")


def pretty_unit(unit: str) -> str:
    """A unit with raised exponents."""
    return unit.replace("^2", "²").replace("^3", "³").replace("^5", "⁵")


def written(value: float, unit: str = "", digits: int = 4) -> str:
    """A value with its unit, in engineering notation where the unit takes prefixes."""
    if not math.isfinite(value):
        return "not known"
    factor, prefix = 1.0, ""
    if unit in WITH_PREFIX and value != 0.0:
        size = float(f"{abs(value):.{digits - 1}e}")  # 999.99 Pa is written as 1 kPa
        factor, prefix = next((each for each in _WRITTEN if size >= each[0]), _WRITTEN[-1])
    number = f"{value / factor:.{digits}g}"
    if "e" in number and 1e-3 <= abs(value / factor) < 1e6:
        number = f"{float(number):g}"
    return f"{number} {prefix}{pretty_unit(unit)}".strip()


def typed(text: str, unit: str = "", name: str = "the value") -> float:
    """The value of a text such as "30 kPa", "3e4" or "3e4 Pa".

    Raises
    ------
    CommandError : where it is not a number, or has another unit.
    """
    match = _TYPED.fullmatch(text.translate(_POWERS))
    factor = None if match is None else _factor(match[2].replace(" ", ""), unit)
    if match is None or factor is None:
        example = written(3e4, unit) if unit in ("Pa", "J/m^3") else written(0.02, unit)
        raise CommandError(f"{displayed(text)} is not a value of {name}; type for example {example}")
    return float(match[1]) * factor


def _factor(given: str, unit: str) -> float | None:
    """How many of `unit` the given unit is, or None."""
    if given in ("", unit):
        return 1.0
    if given in _ALSO.get(unit, {}):
        return _ALSO[unit][given]
    if unit in WITH_PREFIX and given.endswith(unit) and given[: -len(unit)] in _PREFIXES:
        return _PREFIXES[given[: -len(unit)]]
    return None
