"""Running the cases of a study on workers, and keeping track of them."""

from __future__ import annotations

import logging
import queue
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from uuid import uuid4

from supple.app.studies.cases import Case, CaseResult, write_result
from supple.app.studies.run_case import Measure, run_case
from supple.app.studies.sources import Job
from supple.app.studies.workers import Opener, Workers
from supple.errors import StudyError, SuppleError

logger = logging.getLogger(__name__)

_SECOND = 1.0


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


@dataclass
class Tally:
    """The results so far, and the time that the remaining cases will take."""

    cases: int
    progress: Callable[[StudyProgress], None]
    results: dict[str, CaseResult] = field(default_factory=dict)
    _began: float = field(default_factory=time.monotonic)
    _before: int | None = None

    def start(self) -> None:
        """Cases that end from now on tell how long one takes."""
        self._began, self._before = time.monotonic(), len(self.results)
        self.report()

    def add(self, case: Case, result: CaseResult) -> None:
        self.results[case.key] = result
        self.report()

    def report(self) -> None:
        failed = sum(result.status == "failed" for result in self.results.values())
        ended = len(self.results)
        recent = ended - (self._before if self._before is not None else ended)
        left = (self.cases - ended) * (time.monotonic() - self._began) / recent if recent else None
        self.progress(StudyProgress(self.cases, ended - failed, failed, left))


@dataclass(frozen=True)
class Task:
    """A case that is to be simulated."""

    case: Case
    job: Job
    folder: Path


@dataclass(frozen=True)
class Measuring:
    """What workers do with each case: the measure and its identity, and the time from checkpoint to checkpoint [s]."""

    measure: Measure
    measured_by: str
    checkpoint_seconds: float


def run_tasks(tasks: list[Task], opener: Opener, measuring: Measuring, tally: Tally) -> None:
    """Simulate cases. Those that need more memory than a worker has come last, on fewer workers with more each.

    Raises
    ------
    StudyError : where no workers can be started or reached.
    """
    if not tasks:
        return
    tally.start()
    with opener(0) as workers:
        deferred = _run_on(workers, tasks, {}, measuring, tally)
    while deferred:
        largest = max(deferred.values())
        waiting = [task for task in tasks if task.case.key in deferred]
        try:
            with opener(largest) as workers:
                logger.warning("%d cases need more memory than a worker has; they run on fewer workers", len(waiting))
                deferred = _run_on(workers, waiting, deferred, measuring, tally)
        except StudyError as error:  # no machine is large enough for the largest of them
            for task in waiting:
                if deferred[task.case.key] == largest:
                    del deferred[task.case.key]
                    _keep(task, CaseResult("failed", reason=str(error), measured_by=measuring.measured_by), tally)


def _run_on(
    workers: Workers,
    tasks: list[Task],
    needs: Mapping[str, int],
    measuring: Measuring,
    tally: Tally,
) -> dict[str, int]:
    """Simulate cases; the bytes that those need which no worker could take, by key."""
    ended: queue.SimpleQueue[Any] = queue.SimpleQueue()
    running: dict[str, tuple[Any, Task]] = {}
    deferred: dict[str, int] = {}
    for task in tasks:
        try:
            able = workers.able(needs.get(task.case.key, 0))
        except StudyError as error:
            _keep(task, CaseResult("failed", reason=str(error), measured_by=measuring.measured_by), tally)
            continue
        future = workers.client.submit(
            run_case,
            task.job,
            task.folder,
            measuring.measure,
            measuring.measured_by,
            measuring.checkpoint_seconds,
            key=f"case-{task.case.key}-{uuid4().hex[:8]}",
            workers=able,
            pure=False,
        )
        running[future.key] = (future, task)
        future.add_done_callback(ended.put)
    while running:
        try:
            future = ended.get(timeout=_SECOND)
        except queue.Empty:
            workers.tend()
            tally.report()
            continue
        _, task = running.pop(future.key)
        result = _result_of(future, measuring.measured_by)
        if result.status == "deferred":
            # A worker of a cluster knows its limit only while it runs; the next round chooses among all workers.
            if needs.get(task.case.key, 0) >= result.bytes_needed:
                result = CaseResult("failed", reason="the worker has less memory than it had reported", lost=True)
            else:
                deferred[task.case.key] = result.bytes_needed
                continue
        if result.lost:
            _keep(task, result, tally)
        else:
            tally.add(task.case, result)
    return deferred


def _result_of(future: Any, measured_by: str) -> CaseResult:
    from distributed import CancelledError, KilledWorker

    try:
        return future.result()
    except KilledWorker as error:
        reason = f"{error.allowed_failures + 1} workers were lost that simulated it; see the folder workers"
    except CancelledError:
        reason = "it was cancelled: the connection to the scheduler was lost"
    except Exception as error:  # in sending the job, or the result
        reason = f"{type(error).__name__}: {error}"
    return CaseResult("failed", reason=" ".join(reason.split()), measured_by=measured_by, lost=True)


def _keep(task: Task, result: CaseResult, tally: Tally) -> None:
    """Keep the result of a case that did not end in a worker."""
    try:
        task.folder.mkdir(parents=True, exist_ok=True)
        write_result(task.folder, result)
    except (OSError, SuppleError) as error:
        logger.warning("%s", error)
    tally.add(task.case, result)
