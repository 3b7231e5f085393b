"""The factors of a study: the values that one quantity takes, as a list or as a range with a distribution."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import StudyError

MOST_LEVELS = 100_000


class Factor(ABC):
    """The values of one quantity that a study varies."""

    @abstractmethod
    def levels(self, name: str) -> list[Any]:
        """The values that a grid uses.

        Raises
        ------
        StudyError : where the factor has none; the text begins with `name`.
        """

    @abstractmethod
    def quantiles(self, u: NDArray[np.float64]) -> list[Any]:
        """The values at the shares u (n,) of the distribution, 0 <= u < 1."""

    @abstractmethod
    def extremes(self) -> tuple[Any, Any, Any]:
        """The low, the middle and the high value."""


@dataclass(frozen=True)
class Levels(Factor):
    """A list of values, each equally likely."""

    values: tuple[Any, ...]

    def __post_init__(self) -> None:
        if not self.values:
            raise StudyError("a list of values is empty; give at least one value")
        if len(self.values) > MOST_LEVELS:
            raise StudyError(f"a list has {len(self.values)} values; at most {MOST_LEVELS} are allowed")
        object.__setattr__(self, "values", tuple(plain(value) for value in self.values))

    def levels(self, name: str) -> list[Any]:
        return list(self.values)

    def quantiles(self, u: NDArray[np.float64]) -> list[Any]:
        last = len(self.values) - 1
        return [self.values[min(int(share * len(self.values)), last)] for share in u]

    def extremes(self) -> tuple[Any, Any, Any]:
        return self.values[0], self.values[len(self.values) // 2], self.values[-1]


@dataclass(frozen=True)
class _Range(Factor):
    low: float
    high: float
    count: int | None = None

    def __post_init__(self) -> None:
        ends, name = (self.low, self.high), type(self).__name__.lower()
        if any(isinstance(end, bool) or not isinstance(end, int | float | np.number) for end in ends):
            raise StudyError(f"{name}({self.low!r}, {self.high!r}): give two numbers")
        if not all(math.isfinite(end) for end in ends) or not self.low < self.high:
            raise StudyError(f"{self._text}: give two finite numbers, the lower one first")
        n = self.count
        if n is not None and (isinstance(n, bool) or not isinstance(n, int) or not 0 < n <= MOST_LEVELS):
            raise StudyError(f"{self._text}: count is {n!r}; give a whole number from 1 to {MOST_LEVELS}")
        object.__setattr__(self, "low", float(self.low))
        object.__setattr__(self, "high", float(self.high))

    @property
    def _text(self) -> str:
        return f"{type(self).__name__.lower()}({self.low:g}, {self.high:g})"

    def levels(self, name: str) -> list[float]:
        if self.count is None:
            call = f"{self._text[:-1]}, count)"
            raise StudyError(f"factor {name!r}: a grid needs the number of levels; give {call}")
        return self.quantiles(np.linspace(0.0, 1.0, self.count))


class Uniform(_Range):
    """See `uniform`."""

    def quantiles(self, u: NDArray[np.float64]) -> list[float]:
        # Not low + u (high - low), which can miss `high` by round-off at u = 1.
        return [float((1.0 - share) * self.low + share * self.high) for share in u]

    def extremes(self) -> tuple[float, float, float]:
        return self.low, 0.5 * (self.low + self.high), self.high


class LogUniform(_Range):
    """See `loguniform`."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.low <= 0.0:
            raise StudyError(f"{self._text}: the low end must be above zero")

    def quantiles(self, u: NDArray[np.float64]) -> list[float]:
        ratio = math.log(self.high / self.low)
        return [self.high if share == 1.0 else min(self.low * math.exp(share * ratio), self.high) for share in u]

    def extremes(self) -> tuple[float, float, float]:
        return self.low, math.sqrt(self.low) * math.sqrt(self.high), self.high


def uniform(low: float, high: float, count: int | None = None) -> Uniform:
    """Numbers from `low` to `high`, equally likely everywhere.

    Parameters
    ----------
    low, high : ends of the range, in the unit of the factor.
    count : number of levels in a grid, evenly spaced, with both ends. Random designs do not need it.

    Raises
    ------
    StudyError : where the range is empty or not finite, or `count` is not a whole number above zero.
    """
    return Uniform(low, high, count)


def loguniform(low: float, high: float, count: int | None = None) -> LogUniform:
    """Numbers from `low` to `high`, whose logarithms are equally likely everywhere.

    Parameters
    ----------
    low, high : ends of the range, in the unit of the factor; above zero.
    count : number of levels in a grid, in constant ratios, with both ends. Random designs do not need it.

    Raises
    ------
    StudyError : as for `uniform`, and where `low` is not above zero.
    """
    return LogUniform(low, high, count)


def as_factor(name: str, given: Any) -> Factor:
    """A factor as it is, or a list of values as `Levels`.

    Raises
    ------
    StudyError : where it is neither, or a value is neither number, text nor a list of these.
    """
    if isinstance(given, Factor):
        return given
    if isinstance(given, str) or not isinstance(given, Sequence | np.ndarray):
        raise StudyError(
            f"factor {name!r} is {given!r}; give a list of values, sp.studies.uniform(...) or "
            "sp.studies.loguniform(...)"
        )
    try:
        return Levels(tuple(given))
    except StudyError as error:
        raise StudyError(f"factor {name!r}: {error}") from None


def plain(value: Any) -> Any:
    """A value as JSON has it: None, true, false, a finite number, a text, or lists and mappings of these.

    Raises
    ------
    StudyError : where it is none of these.
    """
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, float) and not math.isfinite(value):
        raise StudyError(f"the value {value!r} is not finite")
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, dict) and all(isinstance(key, str) for key in value):
        return {key: plain(item) for key, item in value.items()}
    raise StudyError(f"the value {value!r} is a {type(value).__name__}; give numbers, texts, or lists of these")
