"""Designs of a study: which combinations of the factors' values are simulated."""

from __future__ import annotations

import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.app.studies.factors import Factor
from supple.errors import StudyError

MOST_CASES = 1_000_000


class Design(ABC):
    """How the cases of a study are chosen."""

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

    def points(self, factors: Mapping[str, Factor]) -> list[dict[str, Any]]:
        levels = {name: factor.levels(name) for name, factor in factors.items()}
        _check_count(math.prod(len(values) for values in levels.values()))
        return [dict(zip(levels, values, strict=True)) for values in itertools.product(*levels.values())]


@dataclass(frozen=True)
class Paired(Design):
    """Case k has the k-th level of every factor; all have the same number of levels."""

    def points(self, factors: Mapping[str, Factor]) -> list[dict[str, Any]]:
        levels = {name: factor.levels(name) for name, factor in factors.items()}
        counts = {name: len(values) for name, values in levels.items()}
        if len(set(counts.values())) > 1:
            listed = ", ".join(f"{name!r} has {count}" for name, count in counts.items())
            raise StudyError(f"a paired design needs equally many values of every factor; {listed}")
        return [dict(zip(levels, values, strict=True)) for values in zip(*levels.values(), strict=True)]


@dataclass(frozen=True)
class OneAtATime(Design):
    """The middle value of every factor, then each factor alone at its low and at its high value: for tornado plots."""

    def points(self, factors: Mapping[str, Factor]) -> list[dict[str, Any]]:
        extremes = {name: factor.extremes() for name, factor in factors.items()}
        base = {name: middle for name, (_, middle, _) in extremes.items()}
        return [base] + [{**base, name: end} for name, (low, _, high) in extremes.items() for end in (low, high)]


@dataclass(frozen=True)
class _Random(Design):
    samples: int
    seed: int = 0

    def __post_init__(self) -> None:
        if isinstance(self.samples, bool) or not isinstance(self.samples, int) or self.samples < 1:
            raise StudyError(f"the number of samples is {self.samples!r}; give a whole number above zero")
        if isinstance(self.seed, bool) or not isinstance(self.seed, int) or self.seed < 0:
            raise StudyError(f"the seed is {self.seed!r}; give a whole number of zero or more")
        _check_count(self.samples)

    def points(self, factors: Mapping[str, Factor]) -> list[dict[str, Any]]:
        shares = self._shares(len(factors))
        columns = [factor.quantiles(shares[:, k]) for k, factor in enumerate(factors.values())]
        return [dict(zip(factors, values, strict=True)) for values in zip(*columns, strict=True)]

    @abstractmethod
    def _shares(self, dimensions: int) -> NDArray[np.float64]:
        """(samples, dimensions) from 0 to 1."""


class LatinHypercube(_Random):
    """Random points, of which exactly one lies in each of `samples` equally likely strata of every factor.

    McKay, Beckman, Conover, "A comparison of three methods for selecting values of input variables in the analysis of
    output from a computer code", Technometrics 21 (1979).

    Parameters
    ----------
    samples : number of cases; seed : of the random numbers

    Raises
    ------
    StudyError : where `samples` is not a whole number above zero.
    """

    def _shares(self, dimensions: int) -> NDArray[np.float64]:
        from scipy.stats import qmc

        return qmc.LatinHypercube(dimensions, rng=self.seed).random(self.samples)


class Sobol(_Random):
    """The scrambled sequence of Sobol', which fills the space more evenly than random points.

    Owen, "Scrambling Sobol' and Niederreiter-Xing points", Journal of Complexity 14 (1998).

    Parameters
    ----------
    samples : number of cases, a power of two: only then are the points balanced; seed : of the scrambling

    Raises
    ------
    StudyError : where `samples` is not a power of two.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.samples & (self.samples - 1):
            above = 1 << self.samples.bit_length()
            raise StudyError(
                f"sobol: samples is {self.samples}; give a power of two, such as {above // 2} or {above}: "
                "other numbers of points are not balanced"
            )

    def _shares(self, dimensions: int) -> NDArray[np.float64]:
        from scipy.stats import qmc

        return qmc.Sobol(dimensions, rng=self.seed).random(self.samples)


def _check_count(count: int) -> None:
    if count > MOST_CASES:
        raise StudyError(f"the study has {count:.4g} cases; at most {MOST_CASES} are allowed: use fewer levels")
