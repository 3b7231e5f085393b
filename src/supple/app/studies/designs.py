"""Designs of a study: which combinations of the factors' values are simulated."""

from __future__ import annotations

import itertools
import math
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from supple.app.studies.factors import Factor
from supple.errors import StudyError
from supple.kinds.forms import Whole
from supple.kinds.kind import Kind

MOST_CASES = 1_000_000


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
        levels = {name: factor.levels(name) for name, factor in factors.items()}
        count = math.prod(len(values) for values in levels.values())
        if count > MOST_CASES:
            raise StudyError(f"the study has {count:.4g} cases; at most {MOST_CASES} are allowed: use fewer levels")
        return [dict(zip(levels, values, strict=True)) for values in itertools.product(*levels.values())]


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

    samples: Annotated[int, Whole(1, MOST_CASES)]
    seed: Annotated[int, Whole(0, 2**63 - 1)] = 0

    def points(self, factors: Mapping[str, Factor]) -> list[dict[str, Any]]:
        from scipy.stats import qmc

        shares = qmc.LatinHypercube(len(factors), rng=self.seed).random(self.samples)
        columns = [factor.quantiles(shares[:, k]) for k, factor in enumerate(factors.values())]
        return [dict(zip(factors, values, strict=True)) for values in zip(*columns, strict=True)]


DESIGNS = (Grid, LatinHypercube)
