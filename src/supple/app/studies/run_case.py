"""Simulating one case, in a worker process."""

from __future__ import annotations

import contextlib
import math
import os
import threading
import time
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numba.core import config

from supple.app.runs.recorded import simulate_recorded
from supple.app.studies.cases import CHECKPOINT, LOG, RECORDING, CaseResult, read_result, write_result
from supple.app.studies.sources import Job
from supple.errors import StudyError, SuppleError
from supple.results.recording.reader import Recording, read_recording
from supple.runtime.lock import FolderLock
from supple.runtime.threads import numba_threads

Measure = Callable[[Recording], "float | Mapping[str, float]"]

# A worker has cores and memory for one case.
_ONE_CASE = threading.Lock()
_LONGEST_REASON = 500
# The memory of a worker that has simulated a small scene: Python, NumPy, Numba, compiled kernels [bytes].
_PROGRAM = 300_000_000


@dataclass(frozen=True)
class Measuring:
    """What a worker does with each case.

    Attributes
    ----------
    measure : takes the recording; identity : of the measure
    checkpoint_seconds : time from checkpoint to checkpoint [s]
    memory : what a case may use [bytes]; None where it is unknown
    """

    measure: Measure
    identity: str
    checkpoint_seconds: float
    memory: int | None = None


def run_case(job: Job, folder: Path, measuring: Measuring) -> CaseResult:
    """Simulate, record and measure a case, and keep the result in its folder. Nothing is raised: a failure is a result.

    A case that is finished is not simulated again; where other measures were taken, its recording is measured. One that
    another worker is still busy with counts as lost: the scheduler of a cluster has given it up.
    """
    with _ONE_CASE, numba_threads(_threads()):
        try:
            folder.mkdir(parents=True, exist_ok=True)
            lock = FolderLock(folder)
        except (SuppleError, OSError) as error:
            return CaseResult("failed", reason=_reason(error), lost=True)
        try:
            return _kept(job, folder, measuring)
        finally:
            lock.release()


def _kept(job: Job, folder: Path, measuring: Measuring) -> CaseResult:
    """The result of a case in a folder that no other worker uses; it is kept there."""
    began = time.perf_counter()
    result = CaseResult("failed")
    try:
        result = _earlier(folder) or _simulated(job, folder, measuring)
        if result.simulated:
            result = replace(result, status="failed", reason="", measures={})
            result = replace(result, status="done", measures=_measured(folder / RECORDING, measuring.measure))
    # Of any kind: the function that makes the scene, and the measure, are the user's.
    except (Exception, SystemExit) as error:
        with contextlib.suppress(OSError):
            (folder / LOG).write_text(traceback.format_exc(), encoding="utf-8")
        result = replace(result, reason=_reason(error))
    if result.status == "deferred":
        return result
    result = replace(result, measured_by=measuring.identity, wall_seconds=result.wall_seconds or _since(began))
    try:
        write_result(folder, result)
    except (SuppleError, OSError) as error:
        return CaseResult("failed", reason=_reason(error))
    return result


def _earlier(folder: Path) -> CaseResult | None:
    """The result of an earlier run of the study, where its recording is complete."""
    result = read_result(folder)
    return result if result is not None and result.simulated and (folder / RECORDING).exists() else None


def _simulated(job: Job, folder: Path, measuring: Measuring) -> CaseResult:
    run = job.load(folder)
    needed = _PROGRAM + run.chosen_solver.bytes_needed(run.scene)
    if measuring.memory is not None and needed > measuring.memory:
        return CaseResult("deferred", bytes_needed=needed)
    frames, problem = simulate_recorded(run, folder / RECORDING, folder / CHECKPOINT, measuring.checkpoint_seconds)
    status = "failed" if problem else "done"
    reason = problem[:_LONGEST_REASON]
    return CaseResult(status, reason=reason, frames=frames, simulated=not problem, bytes_needed=needed)


def _measured(path: Path, measure: Measure) -> dict[str, float]:
    with read_recording(path) as recording:
        given: Any = measure(recording)
    named = given if isinstance(given, Mapping) else {"measure": given}
    measures = {}
    for name, value in named.items():
        number = np.asarray(value)
        if number.shape != () or number.dtype.kind not in "iufb":
            raise StudyError(f"the measure {name!r} is {value!r}; return a number, or numbers by name")
        if not math.isfinite(number):
            raise StudyError(f"the measure {name!r} is {float(number)!r}; it must be finite")
        measures[str(name)] = float(number)
    if not measures:
        raise StudyError("no measure was returned; return a number, or numbers by name")
    return measures


def _threads() -> int:
    """Of Numba: as many as the environment gives this worker, otherwise one, because workers share the cores."""
    most: int = config.NUMBA_NUM_THREADS  # pyright: ignore[reportAttributeAccessIssue]
    return most if "NUMBA_NUM_THREADS" in os.environ else 1


def _reason(error: BaseException) -> str:
    text = str(error) if isinstance(error, SuppleError) else f"{type(error).__name__}: {error}"
    if isinstance(error, MemoryError):
        text = f"there was not enough memory: {error or 'make the meshes coarser'}"
    return " ".join(text.split())[:_LONGEST_REASON]


def _since(began: float) -> float:
    return round(time.perf_counter() - began, 3)
