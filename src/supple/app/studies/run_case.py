"""Simulating one case, in a worker process, and the result that it leaves in the case's folder."""

from __future__ import annotations

import contextlib
import json
import math
import os
import threading
import time
import traceback
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Literal

from numba.core import config

from supple.app.runs.recorded import simulate_recorded
from supple.app.studies.measures import MeasureFunction, measured
from supple.app.studies.sources import Job
from supple.errors import SuppleError
from supple.results.recording.reader import read_recording
from supple.runtime.lock import FolderLock
from supple.runtime.memory import in_words
from supple.runtime.replacing import whole_file
from supple.runtime.threads import numba_threads

RESULT, RECORDING, LOG, CHECKPOINT = "result.json", "recording.vtkhdf", "log.txt", "checkpoint"
# A worker has cores and memory for one case.
_ONE_CASE = threading.Lock()
_LONGEST_REASON = 500
# The memory of a worker that has simulated a small scene: Python, NumPy, Numba, compiled kernels [bytes].
_PROGRAM = 300_000_000


@dataclass(frozen=True)
class CaseResult:
    """How a case ended.

    Attributes
    ----------
    status : "done", "failed", or "deferred" where the worker has not enough memory for it
    measures : by name; empty unless done
    reason : one line, why it is not done
    measured_by : the identity of what measured; other measures are taken from the recording
    simulated : whether the recording is complete, so that other measures can be taken from it
    lost : whether it failed because its worker was lost, which is worth another try
    wall_seconds : of the simulation and the first measures
    """

    status: Literal["done", "failed", "deferred"]
    measures: dict[str, float] = field(default_factory=dict)
    reason: str = ""
    measured_by: str = ""
    simulated: bool = False
    lost: bool = False
    wall_seconds: float = 0.0


@dataclass(frozen=True)
class Measuring:
    """What a worker does with each case.

    Attributes
    ----------
    measure : takes the recording; identity : of the measure
    checkpoint_seconds : time from checkpoint to checkpoint [s]; memory : what a case may use [bytes]
    """

    measure: MeasureFunction
    identity: str
    checkpoint_seconds: float
    memory: float = math.inf


def write_result(folder: Path, result: CaseResult) -> None:
    """Keep a result in the case's folder."""
    with whole_file(folder / RESULT) as fresh:
        fresh.write_text(json.dumps(asdict(result), indent=1) + "\n", encoding="utf-8")


def read_result(folder: Path) -> CaseResult | None:
    """The result in a case's folder; None where none exists, or none that can be understood."""
    try:
        result = CaseResult(**json.loads((folder / RESULT).read_text(encoding="utf-8")))
        result = replace(result, measures={str(name): float(value) for name, value in result.measures.items()})
    except (OSError, ValueError, TypeError, AttributeError, RecursionError):
        return None
    return result if result.status in ("done", "failed") and isinstance(result.reason, str) else None


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
            result = _ended(job, folder, measuring)
            if result.status != "deferred":
                write_result(folder, result)
            return result
        except (SuppleError, OSError) as error:
            return CaseResult("failed", reason=_reason(error))
        finally:
            lock.release()


def _ended(job: Job, folder: Path, measuring: Measuring) -> CaseResult:
    """How a case ends in a folder that no other worker uses."""
    began, result = time.perf_counter(), read_result(folder)
    if result is None or not result.simulated or not (folder / RECORDING).exists():
        result = CaseResult("failed")
    result = replace(result, status="failed", measures={}, measured_by=measuring.identity)
    try:
        if not result.simulated:
            run = job(folder)
            needed = _PROGRAM + run.chosen_solver.bytes_needed(run.scene)
            if needed > measuring.memory:
                need = f"needs about {in_words(needed)} of memory; {in_words(measuring.memory)} can be used here"
                return CaseResult("deferred", reason=need)
            _, problem = simulate_recorded(run, folder / RECORDING, folder / CHECKPOINT, measuring.checkpoint_seconds)
            result = replace(result, simulated=not problem, reason=problem[:_LONGEST_REASON])
        if result.simulated:
            with read_recording(folder / RECORDING) as recording:
                result = replace(result, status="done", measures=measured(recording, measuring.measure), reason="")
    # Of any kind: the function that makes the scene, and the measure, are the user's.
    except (Exception, SystemExit) as error:
        with contextlib.suppress(OSError):
            (folder / LOG).write_text(traceback.format_exc(), encoding="utf-8")
        result = replace(result, reason=_reason(error))
    return replace(result, wall_seconds=result.wall_seconds or round(time.perf_counter() - began, 3))


def _threads() -> int:
    """Of Numba: as many as the environment gives this worker, otherwise one, because workers share the cores."""
    most: int = config.NUMBA_NUM_THREADS  # pyright: ignore[reportAttributeAccessIssue]
    return most if "NUMBA_NUM_THREADS" in os.environ else 1


def _reason(error: BaseException) -> str:
    text = str(error) if isinstance(error, SuppleError) else f"{type(error).__name__}: {error}"
    if isinstance(error, MemoryError):
        text = f"there was not enough memory: {error or 'make the meshes coarser'}"
    return " ".join(text.split())[:_LONGEST_REASON]
