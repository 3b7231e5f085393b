"""Checks of numbers that came from outside, and how messages display any value from there."""

from __future__ import annotations

import math

import numpy as np

from supple.errors import CommandError


def displayed(value: object) -> str:
    """Any value as text on one short line."""
    try:
        text = " ".join(repr(value).split())
    except Exception:  # `repr` of an unknown class may raise anything
        text = type(value).__name__
    return text if len(text) <= 60 else text[:57] + "..."


def number(value: object, what: str, low: float, high: float) -> float:
    """The value as float; raises `CommandError` where it is not a finite number from `low` to `high`."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise CommandError(f"{what} is {displayed(value)}; give a number")
    if not low <= value <= high or not math.isfinite(value):
        raise CommandError(f"{what} is {displayed(value)}; it must be from {low:g} to {high:g}")
    return float(value)


def whole(value: object, what: str, low: int, high: int) -> int:
    """The value as int; raises `CommandError` where it is not a whole number from `low` to `high`."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)):
        raise CommandError(f"{what} is {displayed(value)}; give a whole number")
    if not low <= value <= high:
        raise CommandError(f"{what} is {displayed(value)}; it must be from {low} to {high}")
    return int(value)
