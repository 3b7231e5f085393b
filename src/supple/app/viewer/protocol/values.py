"""Checks of values from outside, which raise `CommandError`, and how messages display any value from there."""

from __future__ import annotations

import math

import numpy as np

from supple.app.viewer.protocol import limits
from supple.errors import CommandError, SceneError
from supple.kinds.checks import check_name

Point = tuple[float, float, float]


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


def boolean(value: object, what: str) -> bool:
    """The value; raises `CommandError` where it is neither true nor false."""
    if not isinstance(value, (bool, np.bool_)):
        raise CommandError(f"{what} is {displayed(value)}; give true or false")
    return bool(value)


def one_of(value: object, what: str, names: tuple[str | None, ...]) -> object:
    """The value; raises `CommandError` where it is none of these."""
    if not isinstance(value, str | None) or value not in names:
        raise CommandError(f"{what} is {displayed(value)}; it must be {' or '.join(map(str, names))}")
    return value


def whole(value: object, what: str, low: int, high: int) -> int:
    """The value as int; raises `CommandError` where it is not a whole number from `low` to `high`."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)):
        raise CommandError(f"{what} is {displayed(value)}; give a whole number")
    if not low <= value <= high:
        raise CommandError(f"{what} is {displayed(value)}; it must be from {low} to {high}")
    return int(value)


def checked_point(value: object, what: str) -> Point:
    values = checked_items(value, what, 3, 3)
    x, y, z = (number(item, what, -limits.FARTHEST, limits.FARTHEST) for item in values)
    return x, y, z


def checked_items(value: object, what: str, least: int, most: int) -> list[object]:
    if not isinstance(value, (tuple, list, np.ndarray)) or (isinstance(value, np.ndarray) and value.ndim != 1):
        raise CommandError(f"{what} is {displayed(value)}; give a list")
    if not least <= len(value) <= most:
        raise CommandError(f"{what} has {len(value)} values; give {least if least == most else f'{least} to {most}'}")
    return list(value)


def checked_vertices(value: object, what: str) -> tuple[int, ...]:
    vertices = tuple(whole(item, "vertices", 0, 2**31 - 1) for item in checked_items(value, "vertices", 1, 4))
    if len(set(vertices)) != len(vertices):
        raise CommandError(f"vertices {list(vertices)} contains a vertex twice; give each once")
    return vertices


def checked_weights(value: object, count: int) -> tuple[float, ...]:
    weights = [number(item, "weights", -1e3, 1e3) for item in checked_items(value, "weights", count, count)]
    total = sum(weights)
    if total < 1e-3:
        raise CommandError(f"weights {weights} sum to {total:g}; give barycentric coordinates")
    return tuple(item / total for item in weights)


def checked_index(value: object, what: str) -> int:
    return whole(value, what, 0, 2**31 - 1)


def checked_name(value: object, what: str) -> str:
    try:
        check_name(value, what)
    except SceneError as error:
        raise CommandError(str(error)) from None
    return str(value)
