"""Executors of `concurrent.futures` for the cases of a study: processes of this machine, or workers of a cluster."""

from __future__ import annotations

import logging
import math
import os
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from supple.app.studies.run_case import CaseResult, Measuring, run_case
from supple.app.studies.sources import Case
from supple.errors import StudyError
from supple.runtime.memory import available_bytes, end_with_parent

# Of the memory that is available, what all processes of a study on this machine may use together.
_SHARE = 0.9
_CONNECT_SECONDS = 30
_THREADS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS")

Results = Generator[tuple[Case, CaseResult]]


def results_of(
    cases: Sequence[Case], study: Path, workers: int | None, scheduler: str | None, measuring: Measuring
) -> Results:
    """The results of cases as they end, which are kept in the folder of the study.

    They are simulated in processes of this machine, which share its cores and memory equally (None: one per core).
    Cases whose process was lost, and those that need more memory than a share, come at the end, one at a time. With
    a scheduler of `dask.distributed`, such as "tcp://node1:8786", its workers simulate them.

    Raises
    ------
    StudyError : where the scheduler cannot be reached.
    """
    waiting, alone = deque(cases), deque[Case]()
    if scheduler is not None and waiting:
        with _cluster(scheduler) as executor:
            yield from _results(executor, waiting, len(waiting), study, measuring)
    available = available_bytes()
    budget = math.inf if available is None else _SHARE * available
    for queue, count in (waiting, workers or os.cpu_count() or 1), (alone, 1):
        share = replace(measuring, memory=budget / count)
        while queue:
            with _processes(count) as executor:
                for case, result in _results(executor, queue, count, study, share):
                    if queue is waiting and (result.lost or result.status == "deferred"):
                        alone.append(case)
                    else:
                        yield case, replace(result, status="done" if result.status == "done" else "failed")


def _results(executor: Executor, queue: deque[Case], width: int, study: Path, measuring: Measuring) -> Results:
    """The results of the cases as they end, at most `width` at a time; ends early where the executor is broken.

    The cases that a broken executor was busy with are lost; the others are still in the queue.
    """
    running: dict[Future[CaseResult], Case] = {}
    broken = False
    while running or (queue and not broken):
        while queue and len(running) < width and not broken:
            try:
                running[executor.submit(run_case, queue[0].job, queue[0].folder(study), measuring)] = queue[0]
                queue.popleft()
            except BrokenProcessPool:
                broken = True
        for future in wait(running, return_when=FIRST_COMPLETED).done:
            case = running.pop(future)
            try:
                result = future.result()
            except Exception as error:  # in sending the job or the result, or a lost worker
                broken = broken or isinstance(error, BrokenProcessPool)
                result = CaseResult("failed", reason=_reason(error), measured_by=measuring.identity, lost=True)
            yield case, result


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
