"""Meshers, readers that use a library, and what draws films: forks of one process that has imported what takes long."""

import os
import select
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import pytest

from supple.mesh.io import in_child
from supple.mesh.meshing import child_process, mesher_worker
from supple.results.export import video

# Prints the number of each process, then its exit code.
_PROGRAM = """
import contextlib, json, os, sys
from pathlib import Path
import fast_simplification, h5py, tetgen
import meshio, trimesh
with contextlib.suppress(ImportError):
    from pxr import Sdf, Tf, Usd, UsdGeom
from supple.mesh.io import in_child
from supple.mesh.io.libraries import glb_series, meshio, trimesh, usd, usd_series, vtkhdf_series
from supple.mesh.meshing import mesher_worker

def work(folder, library="", *job):
    os.chdir(folder)
    if library == "film":
        os.dup2(os.open(job[-1], os.O_WRONLY), 2)
        return video_worker.main(list(job[:-1]))
    if library:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        function, path, memory, seconds = job
        limits = int(memory), float(seconds), os.getppid()
        return in_child.main(library, function, Path(path), Path(folder), limits)
    output = os.open("output.txt", os.O_WRONLY)
    os.dup2(output, 1)
    os.dup2(output, 2)
    job = json.loads(Path("job.json").read_text("utf-8"))
    Path("job.json").write_text(json.dumps(job | {"parent": os.getppid()}), "utf-8")
    return mesher_worker.main(Path(folder))

for line in sys.stdin:
    job = line.rstrip("\\n").split("\\t")
    if job[1:2] == ["film"]:
        import pyvista.plotting
        from supple.results.export import video_worker
    child = os.fork()
    if child == 0:
        code = work(*job)
        sys.stderr.flush()
        os._exit(code)
    print(child, flush=True)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""
# With less memory than this, the libraries that others need would count [bytes].
_LEAST_MEMORY = 2**30
_busy = threading.Lock()


@cache
def _server() -> subprocess.Popen[bytes]:
    """One for all tests of this process; it ends with it."""
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "PXR_WORK_THREAD_LIMIT": "1", "MALLOC_ARENA_MAX": "2"}
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    return subprocess.Popen([sys.executable, "-c", _PROGRAM], bufsize=0, env=environment, **pipes)


class _Fork:
    """A process as of `subprocess.Popen`. There is one at a time."""

    def __init__(self, *job: str | Path) -> None:
        _busy.acquire()
        server = _server()
        assert server.stdin is not None
        assert server.stdout is not None
        self._answers = server.stdout
        server.stdin.write(("\t".join(map(str, job)) + "\n").encode())
        self.pid, self.returncode = int(self._answers.readline()), None

    def wait(self, timeout: float | None = None) -> int:
        if self.returncode is None:
            if not select.select([self._answers], [], [], timeout)[0]:
                raise subprocess.TimeoutExpired("a fork", timeout or 0.0)
            self.returncode = int(self._answers.readline())
            _busy.release()
        return self.returncode

    def poll(self) -> int | None:
        try:
            return self.wait(0.0)
        except subprocess.TimeoutExpired:
            return None

    def kill(self) -> None:
        os.kill(self.pid, signal.SIGKILL)


def _reader(command: list[str], *, timeout: float, **_: object) -> SimpleNamespace:
    library, function, path, folder, memory, seconds, _ = command[4:]
    child = _Fork(folder, library, function, path, memory, seconds)
    try:
        return SimpleNamespace(returncode=child.wait(timeout))
    finally:
        if child.poll() is None:
            child.kill()
            child.wait()


def _drawing(command: list[str], **_: object) -> SimpleNamespace:
    with tempfile.NamedTemporaryFile("r", suffix=".txt") as said:
        code = _Fork(os.getcwd(), "film", *command[3:], said.name).wait()
        return SimpleNamespace(returncode=code, stderr=said.read())


_PYTHON, _THE_MESHER = sys.executable, Path(mesher_worker.__file__).resolve()


def _mesher(command: list[str], **options) -> subprocess.Popen[bytes] | _Fork:
    *_, program, folder = command
    memory = in_child.json.loads(Path(folder, "job.json").read_text("utf-8"))["memory_limit"]
    if Path(program) != _THE_MESHER or command[0] != _PYTHON or (memory or _LEAST_MEMORY) < _LEAST_MEMORY:
        return subprocess.Popen(command, **options)
    return _Fork(folder)


@contextmanager
def forked_children() -> Iterator[None]:
    """Within this block, the same programs run with the same limits, without new interpreters."""
    with pytest.MonkeyPatch.context() as patch:
        if hasattr(os, "fork"):
            patch.setattr(in_child, "subprocess", SimpleNamespace(**{**vars(subprocess), "run": _reader}))
            patch.setattr(video, "subprocess", SimpleNamespace(**{**vars(subprocess), "run": _drawing}))
            patch.setattr(child_process, "subprocess", SimpleNamespace(**{**vars(subprocess), "Popen": _mesher}))
        yield
