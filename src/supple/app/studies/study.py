"""A study: what varies, how, and what is measured; and its course from the design to the table."""

from __future__ import annotations

import hashlib
import inspect
import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from supple.app.studies.cases import Case, CaseResult, case_key, read_result, write_result
from supple.app.studies.designs import Design
from supple.app.studies.factors import Factor
from supple.app.studies.measures import Measures
from supple.app.studies.run_case import Measure
from supple.app.studies.runner import Measuring, StudyProgress, Tally, Task, run_tasks
from supple.app.studies.sources import Source
from supple.app.studies.table import StudyTable
from supple.app.studies.workers import Opener, cluster_workers, local_workers
from supple.errors import StudyError, SuppleError
from supple.runtime.lock import FolderLock
from supple.runtime.replacing import output_error, whole_file

TABLE, DESCRIPTION, LOGS = "table.csv", "study.json", "workers"
# A checkpoint takes some hundredths of a second, most of which is the wait for the disk.
CHECKPOINT_SECONDS = 30.0


def ignore_progress(progress: StudyProgress) -> None:
    """Does nothing with it."""


@dataclass(frozen=True, eq=False)
class Study:
    """What a study consists of.

    Attributes
    ----------
    source : what varies
    factors : by name; paths : what each of them sets in the source
    design : which combinations are simulated
    measure : takes a recording, and returns a number, or numbers by name
    units : of factors and measures, by name
    """

    source: Source
    factors: Mapping[str, Factor]
    paths: Mapping[str, tuple[str, ...]]
    design: Design
    measure: Measure
    units: Mapping[str, str]

    def __post_init__(self) -> None:
        if not self.factors:
            raise StudyError("the study has no factors; give at least one")
        if not callable(self.measure):
            raise StudyError(f"measure is {self.measure!r}; give a function of a recording that returns numbers")

    def run(
        self,
        folder: str | Path,
        *,
        workers: int | None = None,
        scheduler: str | None = None,
        retry_failed: bool = False,
        checkpoint_seconds: float = CHECKPOINT_SECONDS,
        progress: Callable[[StudyProgress], None] = ignore_progress,
    ) -> StudyTable:
        """Simulate the cases that have not ended yet; the table of all. See `supple.sweep`."""
        if workers is not None and (isinstance(workers, bool) or not isinstance(workers, int) or workers < 1):
            raise StudyError(f"workers is {workers!r}; give a whole number above zero")
        folder = Path(folder).absolute()
        if not isinstance(checkpoint_seconds, int | float) or not checkpoint_seconds >= 0.0:
            raise StudyError(f"checkpoint_seconds is {checkpoint_seconds!r}; give a number of zero or more [s]")
        plan = self._plan(folder, retry_failed)
        opener = local_workers(workers, folder / LOGS) if scheduler is None else cluster_workers(scheduler)
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise output_error(folder, error) from None
        lock = FolderLock(folder)
        try:
            measuring = Measuring(self.measure, plan.measured_by, float(checkpoint_seconds))
            return self._carried_out(plan, folder, opener, measuring, progress)
        finally:
            lock.release()

    def _carried_out(
        self,
        plan: _Plan,
        folder: Path,
        opener: Opener,
        measuring: Measuring,
        progress: Callable[[StudyProgress], None],
    ) -> StudyTable:
        """The table, after all cases have ended, in a folder that no other study uses."""
        self._describe(folder)
        for case, result in plan.refused:
            case.folder(folder).mkdir(parents=True, exist_ok=True)
            write_result(case.folder(folder), result)
            plan.results[case.key] = result
        units = {name: self.source.unit(paths[0]) for name, paths in self.paths.items()} | dict(self.units)

        def table() -> StudyTable:
            return StudyTable.of(folder, tuple(self.factors), units, plan.cases, plan.results)

        try:
            tally = Tally(len(plan.cases), progress, plan.results)
            run_tasks(plan.tasks, opener, measuring, tally)
        finally:  # also after Ctrl-C: the cases that have ended are in the table
            table().write_csv(folder / TABLE)
        return table()

    def _plan(self, folder: Path, retry_failed: bool) -> _Plan:
        plan = _Plan(measure_identity(self.measure))
        known: set[str] = set()
        for point in self.design.points(self.factors):
            values = {path: value for name, value in point.items() for path in self.paths[name]}
            job = self.source.job(values)
            case = Case(case_key(self.source.identity(values)), point)
            if case.key in known:
                continue
            known.add(case.key)
            plan.cases.append(case)
            try:
                self.source.check(values)
            except SuppleError as error:
                plan.refused.append((case, CaseResult("failed", reason=str(error), measured_by=plan.measured_by)))
                continue
            result = read_result(case.folder(folder))
            if result is not None and _is_final(result, plan.measured_by, retry_failed):
                plan.results[case.key] = result
            else:
                plan.tasks.append(Task(case, job, case.folder(folder)))
        if len(plan.refused) == len(plan.cases):
            raise StudyError(f"no case of the study is allowed; the first one: {plan.refused[0][1].reason}")
        return plan

    def _describe(self, folder: Path) -> None:
        """Keep beside the results what the study was."""
        described = {
            "design": _fields(self.design),
            "factors": {name: {"sets": self.paths[name], **_fields(one)} for name, one in self.factors.items()},
            "units": dict(self.units),
        }
        with whole_file(folder / DESCRIPTION) as fresh:
            fresh.write_text(json.dumps(described, indent=1) + "\n", encoding="utf-8")


@dataclass
class _Plan:
    """What is to be done: cases whose values are not allowed, those that have ended, and those to simulate."""

    measured_by: str
    cases: list[Case] = field(default_factory=list)
    refused: list[tuple[Case, CaseResult]] = field(default_factory=list)
    results: dict[str, CaseResult] = field(default_factory=dict)
    tasks: list[Task] = field(default_factory=list)


def _is_final(result: CaseResult, measured_by: str, retry_failed: bool) -> bool:
    if result.measured_by != measured_by:
        return False
    return result.status == "done" or (not result.lost and not retry_failed)


def measure_identity(measure: Measure) -> str:
    """A hash of what a measure is: of its description, or of the text of its function."""
    if isinstance(measure, Measures):
        text = json.dumps([[name, type(one).__name__, asdict(one)] for name, one in measure.named.items()])
    else:
        try:
            text = inspect.getsource(measure)
        except (OSError, TypeError):
            text = getattr(measure, "__qualname__", type(measure).__qualname__)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _fields(described: Any) -> dict[str, Any]:
    return {"kind": type(described).__name__, **asdict(described)}
