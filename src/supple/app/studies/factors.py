"""The factors of a study: the values that one quantity takes, as a list or as a range with a distribution."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError, StudyError
from supple.kinds.forms import Form, Limits, Name, Whole
from supple.kinds.kind import Kind

MOST_LEVELS = 100_000


@dataclass(frozen=True)
class Values(Form):
    """A list of values of the form `item`, or of any that JSON has."""

    item: Form | None = None

    def checked(self, value: Any, what: str) -> tuple[Any, ...]:
        if isinstance(value, str) or not isinstance(value, Sequence | np.ndarray):
            raise SceneError(f"{what} is {value!r}; give a list")
        if not 0 < len(value) <= MOST_LEVELS:
            raise SceneError(f"{what}: the list has {len(value)} values; give from 1 to {MOST_LEVELS}")
        return tuple(plain(one, what) if self.item is None else self.item.checked(one, what) for one in value)


_RANGE = Limits("give the lower one first")


@dataclass(frozen=True)
class Factor(Kind):
    """The values of one quantity: a list, or a range.

    Parameters
    ----------
    values : numbers, texts, lists or mappings, each equally likely
    uniform : a range of numbers, in the unit of the factor, equally likely everywhere
    loguniform : such a range above zero; the logarithms are equally likely everywhere, in the unit of the factor
    count : levels of a range in a grid, with both ends
    paths : what the factor sets in the scene file; without them, its name is the path

    Raises
    ------
    StudyError : where not exactly one of values and ranges is given, or a value is not allowed.
    """

    kind: ClassVar[str] = "factor"
    error: ClassVar[type[StudyError]] = StudyError
    exactly_one: ClassVar[tuple[str, ...]] = ("values", "uniform", "loguniform")

    values: Annotated[tuple[Any, ...] | None, Values()] = None
    uniform: Annotated[tuple[float, float] | None, _RANGE] = None
    loguniform: Annotated[tuple[float, float] | None, _RANGE] = None
    count: Annotated[int | None, Whole(1, MOST_LEVELS)] = None
    paths: Annotated[tuple[str, ...] | None, Values(Name())] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for key in ("uniform", "loguniform"):
            ends = getattr(self, key)
            if ends is not None and not (np.isfinite(ends).all() and (key == "uniform" or ends[0] > 0.0)):
                bound = "finite" if key == "uniform" else "finite and above zero"
                raise StudyError(f"factor: {key} is {list(ends)}; both ends must be {bound}")

    def levels(self, name: str) -> list[Any]:
        """The values that a grid uses.

        Raises
        ------
        StudyError : where a range has no `count`.
        """
        if self.values is not None:
            return list(self.values)
        if self.count is None:
            raise StudyError(f"factor {name!r}: a grid needs the number of levels of a range; give its count")
        return self.quantiles(np.linspace(0.0, 1.0, self.count))

    def quantiles(self, u: NDArray[np.float64]) -> list[Any]:
        """The values at the shares u (n,) of the distribution, 0 <= u <= 1."""
        if self.values is not None:
            last = len(self.values) - 1
            return [self.values[min(int(share * len(self.values)), last)] for share in u]
        if self.uniform is not None:
            low, high = self.uniform
            # Not low + u (high - low), which can miss `high` by round-off at u = 1.
            return [float((1.0 - share) * low + share * high) for share in u]
        assert self.loguniform is not None
        low, high = self.loguniform
        ratio = math.log(high / low)
        return [high if share == 1.0 else min(low * math.exp(share * ratio), high) for share in u]


def uniform(low: float, high: float, count: int | None = None) -> Factor:
    """Numbers from `low` to `high`, equally likely everywhere.

    Parameters
    ----------
    low, high : ends of the range, in the unit of the factor.
    count : number of levels in a grid, evenly spaced, with both ends. A Latin hypercube does not need it.

    Raises
    ------
    StudyError : where the range is empty or not finite, or `count` is not a whole number above zero.
    """
    return Factor(uniform=(low, high), count=count)


def loguniform(low: float, high: float, count: int | None = None) -> Factor:
    """Numbers from `low` to `high`, whose logarithms are equally likely everywhere.

    Parameters
    ----------
    low, high : ends of the range, in the unit of the factor; above zero.
    count : number of levels in a grid, in constant ratios, with both ends. A Latin hypercube does not need it.

    Raises
    ------
    StudyError : as for `uniform`, and where `low` is not above zero.
    """
    return Factor(loguniform=(low, high), count=count)


def as_factor(name: str, given: Any) -> Factor:
    """A factor as it is, or a list of values as one.

    Raises
    ------
    StudyError : where it is neither, or a value is not one of JSON's.
    """
    if isinstance(given, Factor):
        return given
    if isinstance(given, str) or not isinstance(given, Sequence | np.ndarray):
        hint = "give a list of values, sp.studies.uniform(...) or sp.studies.loguniform(...)"
        raise StudyError(f"factor {name!r} is {given!r}; {hint}")
    try:
        return Factor(values=tuple(given))
    except StudyError as error:
        raise StudyError(f"factor {name!r}: {str(error).removeprefix('factor: ')}") from None


def plain(value: Any, what: str) -> Any:
    """A value as JSON has it: None, true, false, a finite number, a text, or lists and mappings of these.

    Raises
    ------
    SceneError : where it is none of these; the text begins with `what`.
    """
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, float) and not math.isfinite(value):
        raise SceneError(f"{what}: the value {value!r} is not finite")
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, list | tuple):
        return [plain(item, what) for item in value]
    if isinstance(value, dict) and all(isinstance(key, str) for key in value):
        return {key: plain(item, what) for key, item in value.items()}
    raise SceneError(f"{what}: the value {value!r} is a {type(value).__name__}; give numbers, texts, or lists of these")
