"""Values with units, as a person reads them: "30 kPa"."""

from __future__ import annotations

import math

_WRITTEN = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
# Units that are written with a prefix.
WITH_PREFIX = ("Pa", "N", "m", "s", "J", "J/m^3")


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
        factor, prefix = next((entry for entry in _WRITTEN if size >= entry[0]), _WRITTEN[-1])
    number = f"{value / factor:.{digits}g}"
    if "e" in number and 1e-3 <= abs(value / factor) < 1e6:
        number = f"{float(number):g}"
    return f"{number} {prefix}{pretty_unit(unit)}".strip()
