"""What comes from a browser, made fit for use: anyone can send anything."""

from __future__ import annotations

import math
from collections.abc import Sequence


def number(value: object, low: float, high: float) -> float:
    """A number from `low` to `high`; the nearest of them, or `low` where it is no number."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or math.isnan(value):
        return low
    return float(min(max(value, low), high))


def one_of(value: object, known: Sequence[str]) -> str:
    """One of the known words, the first where it is none of them."""
    return value if isinstance(value, str) and value in known else known[0]
