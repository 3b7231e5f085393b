"""Running a mesher in a child process, so that a crash of the mesher does not end this process."""

from __future__ import annotations

import contextlib
import json
import logging
import mmap
import os
import shutil
import signal
import stat
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import MeshingError
from supple.mesh.io.in_child import PREFIX
from supple.mesh.meshing import mesher_worker
from supple.mesh.meshing.option_names import option

logger = logging.getLogger(__name__)

# A folder of a mesher's files that is older than a day belongs to a process that was killed [s].
A_DAY = 86_400.0
# A crash while more than this fraction of the allowed address space is used counts as lack of memory.
STARVED = 0.8
# How TetGen, C++, NumPy and the loader of shared libraries report it, in lower case.
OUT_OF_MEMORY = (
    "out of memory",
    "bad_alloc",
    "memoryerror",
    "unable to allocate",
    "cannot allocate memory",
    "failed to map segment",
)


DEFAULT_TETS = 2_000
"""Fine enough that a body bends, coarse enough for 30 frames/s: with 5,000, a frame of a knot took 14 times as long."""
DAMAGED = ("failed", "crash")
"""Kinds of failures of a mesher that its input causes."""


@dataclass(frozen=True)
class Limits:
    """Wall-clock time [s] and address space [bytes] of the child; None for no memory limit."""

    time: float
    memory: int | None


@dataclass(frozen=True, eq=False)
class MesherResult:
    """Vertices (n, 3), elements (m, 4 or 3) with a label each (m,), unchecked, and the seconds the mesher took."""

    vertices: NDArray[np.float64]
    elements: NDArray[np.int32]
    labels: NDArray[np.float64]
    seconds: float


class MesherFailure(MeshingError):
    """The child returned no mesh; `kind` is "time", "memory", "crash" or "failed"."""

    def __init__(self, kind: str, text: str) -> None:
        super().__init__(text)
        self.kind = kind


def run_mesher(
    mesher: str,
    vertices: NDArray[np.float64],
    elements: NDArray[np.integer],
    options: dict[str, Any],
    limits: Limits,
    remedy: str = "",
) -> MesherResult:
    """Run "tetgen", "mmg" (with tets), "meshfix", "union" or "decimation" (with triangles) in a child.

    The input are triangles (m, 3) of vertices (n, 3). `remedy` ends the message where the
    mesher failed or crashed. A mesh that the child has written before it failed is its result: Mmg tries several.

    Raises
    ------
    MeshingError : where the folder for temporary files cannot be written to.
    MesherFailure : where the child ran out of time or memory, crashed, or failed; it has ended by then.
    """
    _delete_left_behind(Path(tempfile.gettempdir()), max(A_DAY, 2.0 * limits.time))
    with tempfile.TemporaryDirectory(prefix=PREFIX, ignore_cleanup_errors=True) as name:
        folder = Path(name)
        threads = options.get("threads", 1) or os.cpu_count() or 1
        job = {
            "mesher": mesher,
            "parent": os.getpid(),
            "options": options,
            "memory_limit": limits.memory,
            "cpu_seconds": (limits.time + 10.0) * threads,
        }
        try:
            (folder / "job.json").write_text(json.dumps(job), "utf-8")
            np.savez(folder / "surface.npz", vertices=vertices, elements=elements)
        except OSError as error:
            raise _unwritable(folder, error.strerror or str(error)) from None
        started = time.perf_counter()
        try:
            code, peak = _run_child(mesher, folder, limits)
        except MesherFailure:  # its time is over
            if not (folder / "mesh.npz").exists():
                raise
            code, peak = 1, 0
        seconds = time.perf_counter() - started
        answer_file = folder / "answer.json"
        answer = json.loads(answer_file.read_text("utf-8")) if answer_file.exists() else {}
        for note in filter(None, answer.get("notes", [])):
            logger.debug("%s: %s", mesher, note)
        if (folder / "mesh.npz").exists() and "disk" not in answer:
            if code != 0 or "error" in answer:
                logger.info("%s failed at a later mesh; an earlier one is used", mesher)
            with np.load(folder / "mesh.npz") as mesh:
                return MesherResult(mesh["vertices"], mesh["elements"], mesh["labels"], seconds)
        if "disk" in answer:
            raise _unwritable(folder, answer["disk"])
        starved = limits.memory is not None and peak > STARVED * limits.memory
        raise _failure(mesher, code, answer.get("error", ""), _last_line(folder), limits, starved, remedy)


def _delete_left_behind(temporary: Path, age: float) -> None:
    """Delete own folders of meshers whose process was killed: those that are older than an age [s]."""
    for folder in temporary.glob(PREFIX + "*"):
        with contextlib.suppress(OSError):
            known = folder.lstat()
            own = not hasattr(os, "getuid") or known.st_uid == os.getuid()
            if own and stat.S_ISDIR(known.st_mode) and known.st_mtime < time.time() - age:
                shutil.rmtree(folder, ignore_errors=True)


def _run_child(mesher: str, folder: Path, limits: Limits) -> tuple[int, int]:
    """Exit code of the child and its largest address space [bytes], 0 where the platform does not report it.

    The child is killed at the time limit, and when this process is interrupted.
    """
    environment = os.environ | {
        # The child must find the same packages as this process.
        "PYTHONPATH": os.pathsep.join(os.path.abspath(entry) for entry in sys.path if entry),
        # Each thread of the linear algebra library would reserve address space.
        "OPENBLAS_NUM_THREADS": "1",
        "MALLOC_ARENA_MAX": "2",
        "PYTHONIOENCODING": "utf-8",
    }
    # -P: not the worker's folder, nor any current one, on the module search path.
    command = [sys.executable, "-P", str(Path(mesher_worker.__file__).resolve()), str(folder)]
    with (folder / "output.txt").open("wb") as output:
        try:
            # In its own folder, because TetGen writes files such as `_skipped.node` into the current one.
            child = subprocess.Popen(
                command,
                cwd=folder,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
            )
        except (OSError, ValueError, TypeError) as error:
            raise MesherFailure("crash", f"{mesher}: cannot start Python ({sys.executable!r}): {error}") from None
        try:
            end, peak = time.monotonic() + limits.time, 0
            while True:
                try:
                    return child.wait(timeout=max(0.0, min(0.05, end - time.monotonic()))), peak
                except subprocess.TimeoutExpired:
                    peak = max(peak, _address_space(child.pid))
                if time.monotonic() >= end:
                    raise MesherFailure(
                        "time",
                        f"{mesher} was stopped at the time limit of {limits.time:g} s; ask for fewer tets "
                        f"({option('tets')}, which also reduces the surface; a larger "
                        f"{option('quality')}, no {option('min_dihedral')}) or raise {option('time_limit')}",
                    )
        finally:
            if child.poll() is None:
                child.kill()
            child.wait()


def _address_space(pid: int) -> int:
    """Address space [bytes] of a running process, 0 on platforms other than Linux."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[0])
    except (OSError, ValueError, IndexError):
        return 0
    return pages * mmap.PAGESIZE


def _failure(
    mesher: str, code: int, error: str, last: str, limits: Limits, starved: bool, remedy: str
) -> MesherFailure:
    report = (error or last).lower()
    # A program may crash without any message when it gets no memory.
    if any(sign in report for sign in OUT_OF_MEMORY) or (starved and not error):
        limit = "" if limits.memory is None else f" within the memory limit of {limits.memory / 2**20:.0f} MiB"
        return MesherFailure(
            "memory",
            f"{mesher} ran out of memory{limit}; ask for fewer tets ({option('tets')}) or raise "
            f"{option('memory_limit')}",
        )
    if error:
        return MesherFailure("failed", f"{mesher} failed: {error.rstrip('.')}{remedy}")
    how = f"exit code {code}" if code >= 0 else _signal_name(-code)
    output = f", its last output: {last}" if last else ""
    return MesherFailure("crash", f"{mesher} crashed ({how}){output}{remedy}")


def _unwritable(folder: Path, reason: str) -> MeshingError:
    """Not a failure of the mesher: another one would fail too."""
    return MeshingError(f"the mesher's files cannot be written to {folder.parent}: {reason}; make room there")


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def _last_line(folder: Path) -> str:
    """The last line that the child wrote, shortened."""
    with (folder / "output.txt").open("rb") as file:
        file.seek(max(0, file.seek(0, os.SEEK_END) - 4096))
        text = file.read().decode("utf-8", "replace")
    return text.strip().rpartition("\n")[2].strip()[:200]
