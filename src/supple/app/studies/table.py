"""The results of a study as one table: a row per case, a column per factor and per measure, with units."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.app.studies.run_case import CaseResult
from supple.app.studies.sources import Case
from supple.errors import StudyError
from supple.kinds.suggestion import suggestion
from supple.runtime.replacing import whole_file


@dataclass(frozen=True, eq=False)
class StudyTable:
    """The cases of a study that have ended, in the order of its design.

    Attributes
    ----------
    folder : of the study
    factors : names of the factors; measures : names of the measures, which failed cases do not have
    units : of both, where they are known
    rows : (cases,) each case, and what it gave
    keys : (cases,) names of the cases' folders
    reasons : (cases,) why a case failed; empty where it did not
    """

    folder: Path
    factors: tuple[str, ...]
    units: Mapping[str, str]
    rows: tuple[tuple[Case, CaseResult], ...]

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def measures(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(name for _, result in self.rows for name in result.measures))

    @property
    def keys(self) -> tuple[str, ...]:
        return tuple(case.key for case, _ in self.rows)

    @property
    def reasons(self) -> tuple[str, ...]:
        return tuple(result.reason if result.status == "failed" else "" for _, result in self.rows)

    @property
    def done(self) -> NDArray[np.bool_]:
        """(cases,) whether a case has measures."""
        return np.array([result.status == "done" for _, result in self.rows], dtype=bool)

    def __getitem__(self, name: str) -> NDArray[Any]:
        """(cases,) the values of a factor, or a measure, which is NaN where the case failed.

        Raises
        ------
        StudyError : where no such column exists.
        """
        if name in self.measures:
            return np.array([result.measures.get(name, np.nan) for _, result in self.rows])
        if name in self.factors:
            column = [case.values[name] for case, _ in self.rows]
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
            measures = self.measures
            writer.writerow(["case", *map(self.label, [*self.factors, *measures]), "status", "reason"])
            for (case, result), reason in zip(self.rows, self.reasons, strict=True):
                values = [case.values[name] for name in self.factors] + [result.measures.get(name) for name in measures]
                writer.writerow([case.key, *map(_cell, values), result.status, reason])
        return path


def _cell(value: Any) -> str:
    return "" if value is None else value if isinstance(value, str) else json.dumps(value)
