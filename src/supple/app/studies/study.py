"""A study: what varies, how, and what is measured; and its course from the design to the table."""

from __future__ import annotations

import hashlib
import inspect
import json
import logging
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path

from supple.app.studies.cases import Case, CaseResult, case_key, read_result, write_result
from supple.app.studies.designs import Design
from supple.app.studies.executors import Task, run_here, run_on_cluster
from supple.app.studies.factors import Factor
from supple.app.studies.measures import Measures
from supple.app.studies.run_case import Measure, Measuring
from supple.app.studies.sources import Source
from supple.app.studies.table import StudyTable
from supple.errors import StudyError, SuppleError
from supple.runtime.lock import FolderLock
from supple.runtime.replacing import output_error, whole_file

logger = logging.getLogger(__name__)

TABLE, DESCRIPTION = "table.csv", "study.json"
# A checkpoint takes some hundredths of a second, most of which is the wait for the disk.
CHECKPOINT_SECONDS = 30.0


@dataclass(frozen=True)
class StudyProgress:
    """How far a study is.

    Attributes
    ----------
    cases : all; done, failed : of them, with those of earlier runs
    seconds_left : estimate [s]; None before the first case has ended
    """

    cases: int
    done: int
    failed: int
    seconds_left: float | None


def ignore_progress(progress: StudyProgress) -> None:
    """Does nothing with it."""


@dataclass(frozen=True, eq=False)
class Study:
    """What a study consists of.

    Attributes
    ----------
    source : what varies
    factors : by name
    design : which combinations are simulated
    measure : takes a recording, and returns a number, or numbers by name
    units : of factors and measures, by name
    """

    source: Source
    factors: Mapping[str, Factor]
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
        if not isinstance(checkpoint_seconds, int | float) or not checkpoint_seconds >= 0.0:
            raise StudyError(f"checkpoint_seconds is {checkpoint_seconds!r}; give a number of zero or more [s]")
        folder = Path(folder).absolute()
        measuring = Measuring(self.measure, measure_identity(self.measure), float(checkpoint_seconds))
        plan = self._plan(folder, measuring.identity, retry_failed)
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise output_error(folder, error) from None
        lock = FolderLock(folder)
        try:
            self._describe(folder)
            for case, result in plan.refused:
                write_result(case.folder(folder), result)
            self._simulate(plan, workers, scheduler, measuring, progress)
        finally:  # also after Ctrl-C: the cases that have ended are in the table
            units = {name: self.source.unit(self._paths(name)[0]) for name in self.factors} | dict(self.units)
            table = StudyTable.of(folder, tuple(self.factors), units, plan.cases, plan.results)
            table.write_csv(folder / TABLE)
            lock.release()
        return table

    @staticmethod
    def _simulate(
        plan: _Plan,
        workers: int | None,
        scheduler: str | None,
        measuring: Measuring,
        progress: Callable[[StudyProgress], None],
    ) -> None:
        began, before = time.monotonic(), len(plan.results)

        def report() -> None:
            failed, ended = sum(one.status == "failed" for one in plan.results.values()), len(plan.results)
            recent = ended - before
            left = (len(plan.cases) - ended) * (time.monotonic() - began) / recent if recent else None
            progress(StudyProgress(len(plan.cases), ended - failed, failed, left))

        def keep(task: Task, result: CaseResult) -> None:
            if result.reason:  # also of cases that did not end in a worker
                try:
                    write_result(task.folder, result)
                except (OSError, SuppleError) as error:
                    logger.warning("%s", error)
            plan.results[task.case.key] = result
            report()

        if plan.tasks:
            report()
            if scheduler is None:
                run_here(plan.tasks, workers, measuring, keep)
            else:
                run_on_cluster(plan.tasks, scheduler, measuring, keep)

    def _paths(self, name: str) -> tuple[str, ...]:
        return self.factors[name].paths or (name,)

    def _plan(self, folder: Path, measured_by: str, retry_failed: bool) -> _Plan:
        plan, known = _Plan(), set()
        for point in self.design.points(self.factors):
            values = {path: value for name, value in point.items() for path in self._paths(name)}
            job = self.source.job(values)
            case = Case(case_key(self.source.identity(values)), point)
            if case.key in known:
                continue
            known.add(case.key)
            plan.cases.append(case)
            try:
                self.source.check(values)
            except SuppleError as error:
                plan.results[case.key] = CaseResult("failed", reason=str(error), measured_by=measured_by)
                plan.refused.append((case, plan.results[case.key]))
                continue
            result = read_result(case.folder(folder))
            if result is not None and _is_final(result, measured_by, retry_failed):
                plan.results[case.key] = result
            else:
                plan.tasks.append(Task(case, job, case.folder(folder)))
        if len(plan.refused) == len(plan.cases):
            raise StudyError(f"no case of the study is allowed; the first one: {plan.refused[0][1].reason}")
        return plan

    def _describe(self, folder: Path) -> None:
        """Keep beside the results what the study was."""
        design = {"kind": self.design.kind, **asdict(self.design)}
        factors = {name: asdict(factor) for name, factor in self.factors.items()}
        with whole_file(folder / DESCRIPTION) as fresh:
            text = json.dumps({"design": design, "factors": factors, "units": dict(self.units)}, indent=1)
            fresh.write_text(text + "\n", encoding="utf-8")


@dataclass
class _Plan:
    """What is to be done: the cases, those with values that are not allowed, the results so far, what to simulate."""

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
        text = repr(measure)
    else:
        try:
            text = inspect.getsource(measure)
        except (OSError, TypeError):
            text = getattr(measure, "__qualname__", type(measure).__qualname__)
    return hashlib.sha256(text.encode()).hexdigest()[:16]
