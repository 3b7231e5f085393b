"""A study: what varies, how, and what is measured; and its course from the design to the table."""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from supple.app.scene_file.loader import Run
from supple.app.scene_file.paths import unit_of
from supple.app.studies.executors import results_of
from supple.app.studies.factors import Design, Factor, Grid, as_factor
from supple.app.studies.measures import MeasureFunction, Measures
from supple.app.studies.run_case import CaseResult, Measuring, read_result, write_result
from supple.app.studies.sources import Case, Source, digest_of, text_of, varied_file, varied_function
from supple.app.studies.table import StudyTable
from supple.errors import StudyError, SuppleError
from supple.runtime.lock import FolderLock
from supple.runtime.replacing import parent_folder, whole_file
from supple.scene.scene import Scene
from supple.solvers.auto import Auto
from supple.solvers.solver import Solver

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
    measure: MeasureFunction
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
        text = repr(self.measure) if isinstance(self.measure, Measures) else text_of(self.measure)
        measuring = Measuring(self.measure, digest_of(text), float(checkpoint_seconds))
        cases = self._cases()
        results = _known_results(cases, folder, measuring.identity, retry_failed)
        waiting, before, began = [case for case in cases if case.key not in results], len(results), time.monotonic()

        def report() -> None:
            ended, failed = len(results), sum(one.status == "failed" for one in results.values())
            left = (len(cases) - ended) * (time.monotonic() - began) / (ended - before) if ended > before else None
            progress(StudyProgress(len(cases), ended - failed, failed, left))

        parent_folder(folder / TABLE)
        lock = FolderLock(folder)
        try:
            self._describe(folder)
            for case in cases:
                if case.refusal:
                    write_result(case.folder(folder), results[case.key])
            if waiting:
                report()
            with closing(results_of(waiting, folder, workers, scheduler, measuring)) as ended:
                for case, result in ended:
                    if result.reason:  # also of cases that did not end in a worker
                        try:
                            write_result(case.folder(folder), result)
                        except (OSError, SuppleError) as error:
                            logger.warning("%s", error)
                    results[case.key] = result
                    report()
        finally:  # also after Ctrl-C: the cases that have ended are in the table
            rows = tuple((case, results[case.key]) for case in cases if case.key in results)
            table = StudyTable(folder, tuple(self.factors), self.units, rows)
            table.write_csv(folder / TABLE)
            lock.release()
        return table

    def _cases(self) -> list[Case]:
        """Those that differ; raises `StudyError` where none of them is allowed."""
        cases: dict[str, Case] = {}
        for point in self.design.points(self.factors):
            case = self.source(
                {path: value for name, value in point.items() for path in self.factors[name].paths or (name,)}
            )
            cases.setdefault(case.key, replace(case, values=point))
        if all(case.refusal for case in cases.values()):
            raise StudyError(f"no case of the study is allowed; the first one: {next(iter(cases.values())).refusal}")
        return list(cases.values())

    def _describe(self, folder: Path) -> None:
        """Keep beside the results what the study was."""
        design = {"kind": self.design.kind, **asdict(self.design)}
        factors = {name: asdict(factor) for name, factor in self.factors.items()}
        with whole_file(folder / DESCRIPTION) as fresh:
            text = json.dumps({"design": design, "factors": factors, "units": dict(self.units)}, indent=1)
            fresh.write_text(text + "\n", encoding="utf-8")


def _known_results(cases: Sequence[Case], folder: Path, measured_by: str, retry_failed: bool) -> dict[str, CaseResult]:
    """Of the cases that are not allowed, and of those that have ended in an earlier run with the same measure."""
    results = {}
    for case in cases:
        result = read_result(case.folder(folder))
        if case.refusal:
            results[case.key] = CaseResult("failed", reason=case.refusal, measured_by=measured_by)
        elif result is not None and result.measured_by == measured_by:
            final = result.status == "done" or not (result.lost or retry_failed)
            results |= {case.key: result} if final else {}
    return results


def units_of_paths(factors: Mapping[str, Factor]) -> dict[str, str]:
    """The units of the values in a scene file that factors set, by name of the factor; empty where it is not known."""
    return {name: unit_of((factor.paths or (name,))[0]) for name, factor in factors.items()}


def sweep(
    source: Callable[..., Scene | Run] | str | Path,
    factors: Mapping[str, Factor | Sequence[Any]],
    *,
    measure: MeasureFunction,
    design: Design | None = None,
    folder: str | Path = "study",
    solver: Solver | Auto | None = None,
    dt: float = 1.0 / 60.0,
    steps: int = 300,
    units: Mapping[str, str] | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    retry_failed: bool = False,
    checkpoint_seconds: float = CHECKPOINT_SECONDS,
    progress: Callable[[StudyProgress], None] = ignore_progress,
) -> StudyTable:
    """Simulate every case of a study, and return the table of results, which is also in `folder/table.csv`.

    A case that has ended is not simulated again, so that an interrupted study resumes where it was. A case that fails
    is in the table with its reason. A case whose process is lost resumes in another one, from its last checkpoint.

    Parameters
    ----------
    source : a function of the factors that returns a `Scene`, or a `Run` where solver or timing vary too; or the path
        of a scene file, in which factors are dotted paths such as "bodies.bear.material.youngs".
    factors : by name, lists of values, `sp.studies.uniform(...)` or `sp.studies.loguniform(...)`.
    measure : takes a `Recording`, and returns a number, or numbers by name.
    design : `sp.studies.Grid()` (the default) or `sp.studies.LatinHypercube(...)`.
    folder : for the table, and for a folder per case. On a cluster all machines must have it under the same path.
    solver, dt, steps : for a function that returns a `Scene`; dt in [s]. Without a solver, each case has the
        one that suits it.
    units : of factors and measures, by name. Those of a scene file's values are known.
    workers : number of processes on this machine; None: one per core.
    scheduler : address of a scheduler of dask.distributed, such as "tcp://node1:8786", instead of `workers`.
    retry_failed : simulate cases again that failed in an earlier run.
    checkpoint_seconds : time from checkpoint to checkpoint of a case [s]; shorter cases have none
    progress : called whenever a case has ended.

    Raises
    ------
    StudyError, SceneError : before anything is written, where the study cannot be carried out: a factor that does not
        exist, or no case that is allowed; and where no worker can be reached.
    OutputError : where another study is writing to the folder, or it cannot be written.
    """
    named = {name: as_factor(name, given) for name, given in factors.items()}
    of_factors = {} if callable(source) else units_of_paths(named)
    chosen = varied_function(source, solver, dt, steps) if callable(source) else varied_file(source)
    return Study(chosen, named, Grid() if design is None else design, measure, of_factors | dict(units or {})).run(
        folder,
        workers=workers,
        scheduler=scheduler,
        retry_failed=retry_failed,
        checkpoint_seconds=checkpoint_seconds,
        progress=progress,
    )
