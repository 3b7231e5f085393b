"""Factors of a study, which are the values that one quantity takes, and designs, which choose their combinations."""

from __future__ import annotations

import itertools
import json
import math
from abc import abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from operator import methodcaller
from typing import Annotated, Any, ClassVar

import numpy as np

from supple.errors import SceneError, StudyError
from supple.kinds.kind import Kind
from supple.kinds.validators import Integer, Limits, Name, Validator

MOST_LEVELS, MOST_CASES = 100_000, 1_000_000


@dataclass(frozen=True)
class Values(Validator):
    """A list of values that `item` allows, or of any that JSON has."""

    item: Validator | None = None

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
    count: Annotated[int | None, Integer(1, MOST_LEVELS)] = None
    paths: Annotated[tuple[str, ...] | None, Values(Name())] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for ends, least, bound in (self.uniform, -math.inf, "finite"), (self.loguniform, 0.0, "finite and above zero"):
            if ends is not None and not least < ends[0] < ends[1] < math.inf:
                raise StudyError(f"factor: the range is {list(ends)}; both ends must be {bound}")

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
        return self.quantiles(np.linspace(0.0, 1.0, self.count).tolist())

    def quantiles(self, shares: Iterable[float]) -> list[Any]:
        """The values at shares of the distribution, from 0 to 1. Those at the ends are exact."""
        if self.values is not None:
            count = len(self.values)
            return [self.values[min(int(share * count), count - 1)] for share in shares]
        if self.uniform is not None:
            low, high = self.uniform
            return [(1.0 - share) * low + share * high for share in shares]
        assert self.loguniform is not None
        low, high = self.loguniform
        return [min(max(low ** (1.0 - share) * high**share, low), high) for share in shares]


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
    try:
        return given if isinstance(given, Factor) else Factor(values=given)
    except StudyError as error:
        of_name = str(error).replace("factor: values", f"factor {name!r}").replace("factor: ", f"factor {name!r}: ")
        raise StudyError(of_name) from None


def plain(value: Any, what: str) -> Any:
    """A value as JSON has it: None, true, false, a finite number, a text, or lists and mappings of these.

    Raises
    ------
    SceneError : where it is none of these; the text begins with `what`.
    """
    try:
        return json.loads(json.dumps(value, allow_nan=False, default=methodcaller("tolist")))
    except (AttributeError, TypeError, RecursionError):
        kind = type(value).__name__
        raise SceneError(f"{what}: the value {value!r} is a {kind}; give numbers, texts, or lists of these") from None
    except ValueError:
        raise SceneError(f"{what}: the value {value!r} is not finite") from None


@dataclass(frozen=True)
class Design(Kind):
    """How the cases of a study are chosen."""

    error: ClassVar[type[StudyError]] = StudyError

    @abstractmethod
    def points(self, factors: Mapping[str, Factor]) -> list[dict[str, Any]]:
        """The value of every factor in each case.

        Raises
        ------
        StudyError : where the factors do not fit the design.
        """


@dataclass(frozen=True)
class Grid(Design):
    """Every combination of all levels; the last factor varies fastest."""

    kind: ClassVar[str] = "grid"

    def points(self, factors: Mapping[str, Factor]) -> list[dict[str, Any]]:
        levels = [factor.levels(name) for name, factor in factors.items()]
        count = math.prod(map(len, levels))
        if count > MOST_CASES:
            raise StudyError(f"the study has {count:.4g} cases; at most {MOST_CASES} are allowed: use fewer levels")
        return [dict(zip(factors, values, strict=True)) for values in itertools.product(*levels)]


@dataclass(frozen=True)
class LatinHypercube(Design):
    """Random points, of which exactly one lies in each of `samples` equally likely strata of every factor.

    McKay, Beckman, Conover, "A comparison of three methods for selecting values of input variables in the analysis of
    output from a computer code", Technometrics 21 (1979).

    Parameters
    ----------
    samples : number of cases
    seed : of the random numbers

    Raises
    ------
    StudyError : where `samples` is not a whole number above zero.
    """

    kind: ClassVar[str] = "latin_hypercube"

    samples: Annotated[int, Integer(1, MOST_CASES)]
    seed: Annotated[int, Integer(0, 2**63 - 1)] = 0

    def points(self, factors: Mapping[str, Factor]) -> list[dict[str, Any]]:
        from scipy.stats import qmc

        shares = qmc.LatinHypercube(len(factors), rng=self.seed).random(self.samples).T.tolist()
        columns = [factor.quantiles(own) for factor, own in zip(factors.values(), shares, strict=True)]
        return [dict(zip(factors, values, strict=True)) for values in zip(*columns, strict=True)]


DESIGNS = (Grid, LatinHypercube)
