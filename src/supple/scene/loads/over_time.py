"""Values that may change over time: constants, curves, and functions of time."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.checks import float_array
from supple.kinds.kind import Kind, declared
from supple.kinds.validators import ANY_NUMBER, NUMBERS, ListOf, Number, Validator


@dataclass(frozen=True, eq=False)
class Curve(Kind):
    """Piecewise linear values over time; constant before the first and after the last.

    Parameters
    ----------
    times : (k,) strictly increasing [s]
    values : (k,) numbers, or (k, 3) vectors, in the unit of what they are used for

    Raises
    ------
    SceneError : where shapes disagree, times do not increase, or a value is not finite.
    """

    kind: ClassVar[str] = "curve"
    title: ClassVar[str] = "Curve"

    times: Annotated[ArrayLike, NUMBERS]
    values: Annotated[ArrayLike, ListOf(("numbers", "vectors"))]

    def __post_init__(self) -> None:
        super().__post_init__()
        times, values = np.asarray(self.times), np.asarray(self.values)
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


@dataclass(frozen=True)
class OverTimeOf(Validator):
    """A number within bounds, or a vector of shape (3,): a constant, a `Curve`, or a function of time.

    Functions are checked when they are called.

    Attributes
    ----------
    inputs : whether a scene file may name an input, which a program sets from frame to frame
    """

    shape: tuple[int, ...] = ()
    bounds: Number = ANY_NUMBER
    inputs: bool = False

    def checked(self, value: Any, what: str) -> Any:
        if callable(value) and not isinstance(value, Curve):
            return value
        known = value.values if isinstance(value, Curve) else [_checked(value, what, self.shape)]
        _checked(np.asarray(known)[0], what, self.shape)
        if self.shape == ():
            for number in np.asarray(known, dtype=np.float64):
                self.bounds.check_bounds(float(number), what)
        return value if isinstance(value, Curve) else _checked(value, what, self.shape)

    def at(self, value: OverTime, time: float, what: str) -> NDArray[np.float64]:
        """The value at `time` [s].

        Raises
        ------
        SceneError : where it is not finite, of another shape, or beyond its bounds.
        """
        found = value_at(value, time, what, self.shape)
        if self.shape == ():
            self.bounds.check_bounds(float(found), f"{what}({time:g})")
        return found


def value_at(value: OverTime, time: float, what: str, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """The value at `time` [s], of `shape`.

    Raises
    ------
    SceneError : where it is not finite or has another shape.
    """
    if isinstance(value, Curve):  # its values were checked when it was made
        return value(time)
    return _checked(value(time), f"{what}({time:g})", shape) if callable(value) else np.asarray(value)


def script_of(thing: Kind, key: str) -> Callable[[float], NDArray[np.float64]]:
    """A field of a kind that is declared with `OverTimeOf`, as a function of time [s] that checks its values."""
    validator, value, what = declared(type(thing))[key].validator, getattr(thing, key), f"{thing.label}: {key}"
    assert isinstance(validator, OverTimeOf)
    return lambda time: validator.at(value, time, what)


def _checked(value: ArrayLike, what: str, shape: tuple[int, ...]) -> NDArray[np.float64]:
    array = float_array(value, what, "give a number" if shape == () else "give three numbers")
    if array.shape != shape:
        raise SceneError(f"{what} has shape {array.shape}; give {'one number' if shape == () else 'three numbers'}")
    if not np.isfinite(array).all():
        raise SceneError(f"{what} is {array.tolist()}; it must be finite")
    array.flags.writeable = False
    return array
