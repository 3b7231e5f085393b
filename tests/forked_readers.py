"""Readers that use a library, each in a fork of one process: starting Python with the library takes half a second."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from types import SimpleNamespace

import pytest

from supple.mesh.io import in_child

_PROGRAM = """
import contextlib, os, sys
from pathlib import Path
import meshio, trimesh
with contextlib.suppress(ImportError):
    from pxr import Sdf, Tf, Usd, UsdGeom
from supple.mesh.io import in_child
from supple.mesh.io.libraries import glb_series, meshio, trimesh, usd, usd_series, vtkhdf_series
import h5py

for line in sys.stdin:
    library, function, path, folder, memory, seconds = line.rstrip("\\n").split("\\t")
    child = os.fork()
    if child == 0:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        os.chdir(folder)
        limits = int(memory), float(seconds), os.getppid()
        os._exit(in_child.main(library, function, Path(path), Path(folder), limits))
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""


@cache
def _server() -> subprocess.Popen[str]:
    """One for all tests of this process; it ends with it."""
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "PXR_WORK_THREAD_LIMIT": "1"}
    return subprocess.Popen(
        [sys.executable, "-c", _PROGRAM],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env=environment,
    )


def _run(command: list[str], **_: object) -> SimpleNamespace:
    server = _server()
    print(*command[4:10], sep="\t", file=server.stdin, flush=True)
    assert server.stdout is not None
    return SimpleNamespace(returncode=int(server.stdout.readline()))


@contextmanager
def forked_readers() -> Iterator[None]:
    """Within this block, `read_in_child` runs the same program with the same limits, without a new interpreter."""
    with pytest.MonkeyPatch.context() as patch:
        if hasattr(os, "fork"):
            patch.setattr(in_child, "subprocess", SimpleNamespace(**{**vars(subprocess), "run": _run}))
        yield
