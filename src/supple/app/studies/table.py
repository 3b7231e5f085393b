"""The results of a study as one table: a row per case, a column per factor and per measure, with units."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.app.studies.cases import Case, CaseResult
from supple.errors import StudyError
from supple.kinds.suggestion import suggestion
from supple.runtime.replacing import whole_file


@dataclass(frozen=True, eq=False)
class StudyTable:
    """The cases of a study in the order of its design.

    Attributes
    ----------
    folder : of the study
    factors : names of the factors; measures : names of the measures, which failed cases do not have
    units : of both, where they are known
    keys : (cases,) names of the cases' folders
    values : (cases,) of the factors, by name; results : (cases,) what each case gave
    reasons : (cases,) why a case failed; empty where it did not
    """

    folder: Path
    factors: tuple[str, ...]
    measures: tuple[str, ...]
    units: Mapping[str, str]
    keys: tuple[str, ...]
    values: tuple[Mapping[str, Any], ...]
    results: tuple[CaseResult, ...]

    @classmethod
    def of(
        cls,
        folder: Path,
        factors: Sequence[str],
        units: Mapping[str, str],
        cases: Sequence[Case],
        results: Mapping[str, CaseResult],
    ) -> StudyTable:
        """The table of those cases that have a result."""
        ended = [case for case in cases if case.key in results]
        own = [results[case.key] for case in ended]
        measures = dict.fromkeys(name for result in own for name in result.measures)
        return cls(
            folder,
            tuple(factors),
            tuple(measures),
            dict(units),
            tuple(case.key for case in ended),
            tuple(case.values for case in ended),
            tuple(own),
        )

    def __len__(self) -> int:
        return len(self.keys)

    @property
    def reasons(self) -> tuple[str, ...]:
        return tuple(result.reason if result.status == "failed" else "" for result in self.results)

    @property
    def done(self) -> NDArray[np.bool_]:
        """(cases,) whether a case has measures."""
        return np.array([result.status == "done" for result in self.results], dtype=bool)

    def __getitem__(self, name: str) -> NDArray[Any]:
        """(cases,) the values of a factor, or a measure, which is NaN where the case failed.

        Raises
        ------
        StudyError : where no such column exists.
        """
        if name in self.measures:
            return np.array([result.measures.get(name, np.nan) for result in self.results])
        if name in self.factors:
            column = [values[name] for values in self.values]
            numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in column)
            if numbers:
                return np.array(column)
            made = np.empty(len(column), dtype=object)
            made[:] = column
            return made
        raise StudyError(f"the table has no column {name!r}; {suggestion(name, [*self.factors, *self.measures])}")

    def label(self, name: str) -> str:
        """A column's name with its unit, such as "tip [m]"."""
        unit = self.units.get(name, "")
        return f"{name} [{unit}]" if unit else name

    def write_csv(self, path: str | Path) -> Path:
        """Write the table as CSV, with units in the first line. Numbers are read back with the same bits.

        Raises
        ------
        OutputError : where it cannot be written.
        """
        path = Path(path)
        with whole_file(path) as fresh, fresh.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            names = [*self.factors, *self.measures]
            writer.writerow(["case", *(self.label(name) for name in names), "status", "reason"])
            for key, values, result, reason in zip(self.keys, self.values, self.results, self.reasons, strict=True):
                given = [_cell(values[name]) for name in self.factors]
                measured = [_cell(result.measures.get(name)) for name in self.measures]
                writer.writerow([key, *given, *measured, result.status, reason])
        return path


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, str):
        return value
    return json.dumps(value)
