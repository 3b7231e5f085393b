"""From the bytes of an uploaded file to a tet mesh, in a child process with bounds on time and memory."""

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

from supple.errors import MeshError, MeshingError
from supple.viewer.protocol import limits
from supple.viewer.server.uploads.worker import ANSWER, JOB, MESH

# How often the child is looked at [s].
_POLL = 0.1


@dataclass(frozen=True, eq=False)
class Upload:
    """A file as it came from a browser.

    Attributes
    ----------
    name : what the visitor calls it, to be shown only; suffix : one of `limits.UPLOAD_FORMATS`
    content : its bytes; size : what its largest extent becomes [m]
    """

    name: str
    suffix: str
    content: bytes
    size: float


@dataclass(frozen=True, eq=False)
class TetArrays:
    """Vertices (n, 3) [m] and tets (m, 4), rows of them."""

    vertices: NDArray[np.float64]
    tets: NDArray[np.int32]


def mesh_of_upload(
    upload: Upload, progress: Callable[[float], None] = lambda seconds: None, stop: threading.Event | None = None
) -> TetArrays:
    """Read a surface and fill it with tets.

    Parameters
    ----------
    tell : called now and then with the seconds that have gone by
    stop : ends it early

    Raises
    ------
    MeshError, MeshingError : what is wrong with the file, or which bound it met, and the mend.
    """
    with tempfile.TemporaryDirectory(prefix="supple-upload-", ignore_cleanup_errors=True) as made:
        folder = Path(made)
        # The visitor's name for it is nowhere part of a path.
        stored = f"mesh{upload.suffix}"
        (folder / stored).write_bytes(upload.content)
        job = {
            "file": stored,
            "size": upload.size,
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
            raise MeshingError(f"{upload.name}: reading it failed (exit code {code}); make it smaller or save it anew")
        with np.load(folder / MESH, allow_pickle=False) as mesh:
            return TetArrays(mesh["vertices"], mesh["tets"])


def _run(folder: Path, progress: Callable[[float], None], stop: threading.Event) -> int:
    """Exit code of the child."""
    environment = os.environ | {
        # The child finds the same packages as this process, however this one found them.
        "PYTHONPATH": os.pathsep.join(os.path.abspath(entry) for entry in sys.path if entry),
        "OPENBLAS_NUM_THREADS": "1",  # idle threads would use up the address space
        "MALLOC_ARENA_MAX": "2",
        "PYTHONIOENCODING": "utf-8",
        "TMPDIR": str(folder),  # whatever it leaves there goes with the folder
    }
    with (folder / "output.txt").open("wb") as output:
        child = subprocess.Popen(
            [sys.executable, "-P", "-m", "supple.viewer.server.uploads.worker"],
            cwd=folder,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=output,
            stderr=subprocess.STDOUT,
            # A group of its own, to be ended together with the mesher that it starts.
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
