"""Converts values from a browser, which can be anything, into valid ones."""

from __future__ import annotations

import math
from collections.abc import Sequence


def number(value: object, low: float, high: float) -> float:
    """The nearest number from `low` to `high`; `low` where the value is not a number."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or math.isnan(value):
        return low
    return float(min(max(value, low), high))


def one_of(value: object, known: Sequence[str]) -> str:
    """The value where it is one of the known options, otherwise the first option."""
    return value if isinstance(value, str) and value in known else known[0]
