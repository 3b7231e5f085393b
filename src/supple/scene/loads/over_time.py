"""Values that may change over time: constants, curves, and functions of time."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.scene.values import float_array

# The least and the largest value that a number may have.
Limits = tuple[float, float]
ANY: Limits = (-math.inf, math.inf)


@dataclass(frozen=True, eq=False)
class Curve:
    """Piecewise linear values over time; constant before the first and after the last.

    Parameters
    ----------
    times : (k,) strictly increasing [s]
    values : (k,) numbers, or (k, 3) vectors, in the unit of what they are used for

    Raises
    ------
    SceneError : where shapes disagree, times do not increase, or a value is not finite.
    """

    times: ArrayLike
    values: ArrayLike

    def __post_init__(self) -> None:
        times, values = float_array(self.times, "Curve: times"), float_array(self.values, "Curve: values")
        if times.ndim != 1 or len(times) == 0:
            raise SceneError(f"Curve: times has shape {times.shape}; give one time or more")
        if values.shape not in ((len(times),), (len(times), 3)):
            raise SceneError(f"Curve: values has shape {values.shape}; give {len(times)} numbers or vectors")
        if not (np.isfinite(times).all() and np.isfinite(values).all()):
            raise SceneError("Curve: holds a number that is not finite")
        late = np.flatnonzero(np.diff(times) <= 0.0)
        if len(late):
            k = int(late[0])
            raise SceneError(f"Curve: times[{k + 1}] = {times[k + 1]:g} s does not come after {times[k]:g} s")
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "values", values)

    def __call__(self, time: float) -> NDArray[np.float64]:
        """The value at `time` [s]."""
        times, values = self._lists
        k = bisect_right(times, time)
        if k in (0, len(times)):
            return values[min(k, len(times) - 1)].copy()
        slope = (values[k] - values[k - 1]) / (times[k] - times[k - 1])
        return np.asarray(slope * (time - times[k - 1]) + values[k - 1])

    @cached_property
    def _lists(self) -> tuple[list[float], list[NDArray[np.float64]]]:
        """Times and values; to search in a list takes a tenth of the time of `np.interp`."""
        return np.asarray(self.times).tolist(), list(map(np.asarray, np.asarray(self.values)))


OverTime = ArrayLike | Curve | Callable[[float], ArrayLike]


def checked_over_time(value: OverTime, what: str, shape: tuple[int, ...]) -> OverTime:
    """The value, as an array of `shape` where it is a constant; functions are checked when they are called.

    Raises
    ------
    SceneError : where a constant or a curve is not finite or has another shape.
    """
    if isinstance(value, Curve):
        _checked(value(float(np.asarray(value.times)[0])), what, shape)
        return value
    return value if callable(value) else _checked(value, what, shape)


def value_at(value: OverTime, time: float, what: str, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """The value at `time` [s], of `shape`.

    Raises
    ------
    SceneError : where it is not finite or has another shape.
    """
    if isinstance(value, Curve):  # its values were checked when it was made
        return value(time)
    return _checked(value(time), f"{what}({time:g})", shape) if callable(value) else np.asarray(value)


def checked_magnitude(value: OverTime, what: str, *, zero: bool = True, limits: Limits = ANY) -> OverTime:
    """`checked_over_time` of a number within `limits` that is never below zero and, without `zero`, always above it.

    Raises
    ------
    SceneError : where it is not.
    """
    given = checked_over_time(value, what, ())
    known = given.values if isinstance(given, Curve) else () if callable(given) else given
    for number in np.atleast_1d(np.asarray(known, dtype=np.float64)):
        _check_magnitude(float(number), what, zero, limits)
    return given


def magnitude_at(value: OverTime, time: float, what: str, *, zero: bool = True, limits: Limits = ANY) -> float:
    """The value of such a number at `time` [s].

    Raises
    ------
    SceneError : where it is not finite, or beyond its limits.
    """
    number = float(value_at(value, time, what, ()))
    _check_magnitude(number, f"{what}({time:g})", zero, limits)
    return number


def _check_magnitude(number: float, what: str, zero: bool, limits: Limits) -> None:
    if number < 0.0 or (number == 0.0 and not zero):
        raise SceneError(f"{what} is {number:g}; it must be {'zero or more' if zero else 'above zero'}")
    if not limits[0] <= number <= limits[1]:
        raise SceneError(f"{what} is {number:g}; it must be from {limits[0]:g} to {limits[1]:g}")


def _checked(value: ArrayLike, what: str, shape: tuple[int, ...]) -> NDArray[np.float64]:
    array = float_array(value, what, "give a number" if shape == () else "give three numbers")
    if array.shape != shape:
        raise SceneError(f"{what} has shape {array.shape}; give {'one number' if shape == () else 'three numbers'}")
    if not np.isfinite(array).all():
        raise SceneError(f"{what} is {array.tolist()}; it must be finite")
    array.flags.writeable = False
    return array
