"""Executors of `concurrent.futures` for the cases of a study: processes of this machine, or workers of a cluster."""

from __future__ import annotations

import logging
import os
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from supple.app.studies.cases import Case, CaseResult
from supple.app.studies.run_case import Measuring, run_case
from supple.app.studies.sources import Job
from supple.errors import StudyError
from supple.runtime.memory import available_bytes, end_with_parent, in_words

# Of the memory that is available, what all processes of a study on this machine may use together.
_SHARE = 0.9
_CONNECT_SECONDS = 30
_THREADS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS")


@dataclass(frozen=True)
class Task:
    """A case that is to be simulated."""

    case: Case
    job: Job
    folder: Path


Keep = Callable[[Task, CaseResult], None]


def run_here(tasks: list[Task], workers: int | None, measuring: Measuring, keep: Keep) -> None:
    """Simulate cases in processes of this machine, which share its cores and memory equally (None: one per core).

    Cases whose process was lost, and those that need more memory than a share, are simulated one at a time at the end.
    """
    count = workers or os.cpu_count() or 1
    available = available_bytes()
    budget = None if available is None else int(_SHARE * available)
    queue, alone = deque(tasks), []
    while queue:
        with _processes(count) as executor:
            share = replace(measuring, memory=None if budget is None else budget // count)
            for task, result in _results(executor, queue, count, share):
                if result.lost or result.status == "deferred":
                    alone.append(task)
                else:
                    keep(task, result)
    queue = deque(alone)
    while queue:
        with _processes(1) as executor:
            for task, result in _results(executor, queue, 1, replace(measuring, memory=budget)):
                if result.status == "deferred":
                    need = f"needs about {in_words(result.bytes_needed)} of memory"
                    result = replace(
                        result, status="failed", reason=f"{need}; {in_words(budget or 0)} can be used here"
                    )
                keep(task, result)


def run_on_cluster(tasks: list[Task], scheduler: str, measuring: Measuring, keep: Keep) -> None:
    """Simulate cases on the workers of a scheduler of `dask.distributed`, such as "tcp://node1:8786".

    Raises
    ------
    StudyError : where the scheduler cannot be reached.
    """
    with _cluster(scheduler) as executor:
        for task, result in _results(executor, deque(tasks), len(tasks), measuring):
            keep(task, result)


def _results(
    executor: Executor, queue: deque[Task], width: int, measuring: Measuring
) -> Iterator[tuple[Task, CaseResult]]:
    """The results of the cases as they end, at most `width` at a time; ends early where the executor is broken.

    The cases that a broken executor was busy with are lost; the others are still in the queue.
    """
    running: dict[Future[CaseResult], Task] = {}
    broken = False
    while running or (queue and not broken):
        while queue and len(running) < width and not broken:
            task = queue.popleft()
            try:
                running[executor.submit(run_case, task.job, task.folder, measuring)] = task
            except BrokenProcessPool:
                broken = True
                queue.appendleft(task)
        for future in wait(running, return_when=FIRST_COMPLETED).done:
            task = running.pop(future)
            try:
                result = future.result()
            except Exception as error:  # in sending the job or the result, or a lost worker
                broken = broken or isinstance(error, BrokenProcessPool)
                result = CaseResult("failed", reason=_reason(error), measured_by=measuring.identity, lost=True)
            yield task, result


def _reason(error: Exception) -> str:
    """Why a case has no result; one line."""
    if isinstance(error, BrokenProcessPool):
        return "the process that simulated it was lost: killed, or out of memory"
    failures = getattr(error, "allowed_failures", None)  # of KilledWorker of a cluster
    if failures is not None:
        return f"{failures + 1} workers were lost that simulated it"
    return " ".join(f"{type(error).__name__}: {error}".split())


@contextmanager
def _processes(count: int) -> Iterator[Executor]:
    """Processes that end with this one. They do not import the script of the user, unlike those of the library."""
    try:
        from loky import ProcessPoolExecutor
    except ImportError:
        raise StudyError("a study on this machine needs loky; pip install 'supple[studies]'") from None
    threads = dict.fromkeys(_THREADS, str(max(1, (os.cpu_count() or 1) // count)))
    executor = ProcessPoolExecutor(count, env=threads, initializer=end_with_parent, initargs=(os.getpid(),))
    try:
        yield executor
    finally:
        executor.shutdown(kill_workers=True)


@contextmanager
def _cluster(scheduler: str) -> Iterator[Executor]:
    try:
        from distributed import Client
    except ImportError:
        raise StudyError("a study on a cluster needs dask.distributed; pip install 'supple[cluster]'") from None
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # it reports each connection
    try:
        client = Client(scheduler, timeout=_CONNECT_SECONDS, set_as_default=False)
    except (OSError, ValueError, RuntimeError) as error:
        reason = " ".join(str(error).split())
        raise StudyError(f"the scheduler {scheduler} cannot be reached: {reason}; see `dask scheduler`") from None
    with client:
        yield client.get_executor(pure=False)
