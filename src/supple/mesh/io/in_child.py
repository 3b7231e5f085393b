"""Reading a file with a library that trusts it, in a child process with limits of memory and time."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from textwrap import shorten

import numpy as np

from supple.mesh.io.cells import CellSoup, FormatError, MeshFile

# What a library needs of memory: itself, and numbers of Python's for each byte of a text [bytes].
_LEAST_MEMORY, _MEMORY_OF_A_BYTE = 2**31, 64
_SECONDS, _SECONDS_OF_A_BYTE = 60.0, 1e-5
# Of the folder of its files. What a killed process leaves of them is deleted as that of meshers is.
PREFIX = "supple-mesh-"


def read_in_child(data: bytes, library: str, suffix: str) -> MeshFile:
    """What `read_file` of the module `supple.mesh.io.libraries.<library>` returns for a file of these bytes.

    Raises
    ------
    FormatError : its own one; or one that says how the library failed, or that it needed too much memory or time.
    """
    try:
        return _read(data, library, suffix)
    except OSError as error:
        reason = error.strerror or error
        raise FormatError(f"{library} cannot work in {tempfile.gettempdir()}: {reason}; make room there") from None


def _read(data: bytes, library: str, suffix: str) -> MeshFile:
    with tempfile.TemporaryDirectory(prefix=PREFIX, ignore_cleanup_errors=True) as name:
        folder = Path(name)
        (folder / f"file{suffix}").write_bytes(data)
        memory = _LEAST_MEMORY + _MEMORY_OF_A_BYTE * len(data)
        seconds = _SECONDS + _SECONDS_OF_A_BYTE * len(data)
        command = [sys.executable, "-P", "-m", "supple.mesh.io.child_program", library, str(folder / f"file{suffix}")]
        environment = os.environ | {
            "PYTHONPATH": os.pathsep.join(os.path.abspath(entry) for entry in sys.path if entry),
            "OPENBLAS_NUM_THREADS": "1",  # each thread would reserve address space
        }
        try:
            done = subprocess.run(
                [*command, str(memory), str(seconds), str(os.getpid())],
                env=environment,
                cwd=folder,
                stdin=subprocess.DEVNULL,
                capture_output=True,
                timeout=seconds,
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise FormatError(f"{library} did not read it within {seconds:.0f} s: it is damaged") from None
        answer_file = folder / "answer.json"
        answer = json.loads(answer_file.read_text("utf-8")) if answer_file.exists() else {}
        if "disk" in answer:
            raise OSError(0, answer["disk"])
        if done.returncode != 0 or "sets" not in answer:
            reason = answer.get("error", "its process ended")
            if not answer.get("ours"):
                reason = f"it is damaged, or of a kind that {library} cannot read: {reason.replace(str(folder), '')}"
            raise FormatError(shorten(reason, 300))
        with np.load(folder / "arrays.npz") as arrays:
            soup = CellSoup(*(arrays[field] for field in CellSoup._fields))
            sets = [
                {each: arrays[f"{kind}_{k}"] for k, each in enumerate(answer["sets"][kind])} for kind in ("node", "tet")
            ]
        return MeshFile(soup, *sets)
