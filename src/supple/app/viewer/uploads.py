"""Meshes an uploaded file in a child process with limits for time and memory."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from supple.app.viewer.protocol import limits
from supple.app.viewer.upload_worker import ANSWER, JOB, MESH
from supple.errors import MeshError, MeshingError
from supple.mesh.meshing.child_process import DEFAULT_TETS

# Time between two checks of the child [s].
_POLL = 0.1


@dataclass(frozen=True, eq=False)
class Upload:
    """A file from a browser.

    Attributes
    ----------
    name : given by the visitor, only for display; suffix : one of `limits.UPLOAD_FORMATS`
    content : its bytes; size : largest extent of the new body [m]
    tets : about how many it gets at most, where its surface allows so few
    """

    name: str
    suffix: str
    content: bytes
    size: float
    tets: int = DEFAULT_TETS


def mesh_of_upload(
    upload: Upload, progress: Callable[[float], None] = lambda seconds: None, stop: threading.Event | None = None
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Read a surface and mesh it: vertices (n, 3) [m] and tets (m, 4), rows of them.

    Parameters
    ----------
    progress : called now and then with the seconds that have gone by
    stop : ends it early where it is set

    Raises
    ------
    MeshError, MeshingError : what is wrong with the file, or which limit it exceeds, and the remedy.
    """
    with tempfile.TemporaryDirectory(prefix="supple-upload-", ignore_cleanup_errors=True) as made:
        folder = Path(made)
        # The name that the visitor gives is not part of any path.
        stored = f"mesh{upload.suffix}"
        (folder / stored).write_bytes(upload.content)
        job = {
            "file": stored,
            "size": upload.size,
            "tets": upload.tets,
            "triangles": limits.MOST_UPLOADED_TRIANGLES,
            "seconds": limits.LONGEST_UPLOAD,
            "memory": limits.UPLOAD_MEMORY,
        }
        (folder / JOB).write_text(json.dumps(job), "utf-8")
        code = _run(folder, progress, stop or threading.Event())
        answer = folder / ANSWER
        if answer.exists():
            message = str(json.loads(answer.read_text("utf-8"))["error"])
            raise MeshError(message.replace(stored, upload.name))
        if code != 0 or not (folder / MESH).exists():
            raise MeshingError(f"{upload.name}: reading it failed (exit code {code}); make it smaller or save it again")
        with np.load(folder / MESH, allow_pickle=False) as mesh:
            return mesh["vertices"], mesh["tets"]


def _run(folder: Path, progress: Callable[[float], None], stop: threading.Event) -> int:
    """Run the child; returns its exit code."""
    environment = os.environ | {
        # The child uses the same packages as this process.
        "PYTHONPATH": os.pathsep.join(os.path.abspath(entry) for entry in sys.path if entry),
        "OPENBLAS_NUM_THREADS": "1",  # idle threads would use the address space
        "MALLOC_ARENA_MAX": "2",
        "PYTHONIOENCODING": "utf-8",
        "TMPDIR": str(folder),  # is deleted with the folder
    }
    with (folder / "output.txt").open("wb") as output:
        child = subprocess.Popen(
            [sys.executable, "-P", "-m", "supple.app.viewer.upload_worker"],
            cwd=folder,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=output,
            stderr=subprocess.STDOUT,
            # Its own process group, which also contains the mesher that it starts.
            start_new_session=True,
        )
    began = time.monotonic()
    try:
        while True:
            with contextlib.suppress(subprocess.TimeoutExpired):
                return child.wait(timeout=_POLL)
            seconds = time.monotonic() - began
            progress(seconds)
            if stop.is_set():
                raise MeshingError("the page was closed")
            if seconds > limits.LONGEST_UPLOAD:
                raise MeshingError(f"it takes longer than {limits.LONGEST_UPLOAD:g} s; make the surface coarser")
    finally:
        if child.poll() is None:
            if hasattr(os, "killpg"):
                with contextlib.suppress(OSError):
                    os.killpg(child.pid, signal.SIGKILL)
            child.kill()
        child.wait()
        if child.stdin is not None:
            child.stdin.close()
