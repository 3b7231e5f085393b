"""Reading a file with a library that trusts it, in a child process with limits of memory and time.

The child runs this module as its program.
"""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from textwrap import shorten
from typing import Any

import numpy as np

from supple.mesh.io.cells import CellSoup, FormatError, MeshFile
from supple.runtime.memory import end_with_parent, limit_process

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
    with _folder(library) as folder:
        file = folder / f"file{suffix}"
        file.write_bytes(data)
        facts = _run(library, "read_file", file, folder)
        with np.load(folder / "arrays.npz") as arrays:
            soup = CellSoup(*(arrays[field] for field in CellSoup._fields))
            nodes, cells = (
                {name: arrays[f"{kind}_{k}"] for k, name in enumerate(facts[kind])} for kind in ("node", "cell")
            )
        return MeshFile(soup, nodes, cells, facts["notes"], facts["up"])


def arrays_in_child(path: Path, library: str) -> tuple[dict[str, Any], dict[str, Any], Any]:
    """What `read_series` of a library finds in a file: facts, arrays, and the positions (frames, n, 3), mapped.

    Raises
    ------
    FormatError : as of `read_in_child`.
    """
    with _folder(library) as folder:
        facts = _run(library, "read_series", path.absolute(), folder)
        with np.load(folder / "arrays.npz") as arrays:
            return facts, dict(arrays), np.load(folder / "positions.npy", mmap_mode="r")


@contextmanager
def _folder(library: str) -> Iterator[Path]:
    try:
        with tempfile.TemporaryDirectory(prefix=PREFIX, ignore_cleanup_errors=True) as name:
            yield Path(name)
    except OSError as error:
        reason = error.strerror or error
        raise FormatError(f"{library} cannot work in {tempfile.gettempdir()}: {reason}; make room there") from None


def _run(library: str, function: str, source: Path, folder: Path) -> dict[str, Any]:
    """The facts that the child writes; its arrays are files in the folder."""
    size = source.stat().st_size
    memory = _LEAST_MEMORY + _MEMORY_OF_A_BYTE * size
    seconds = _SECONDS + _SECONDS_OF_A_BYTE * size
    command = [sys.executable, "-P", "-m", "supple.mesh.io.in_child", library, function, str(source), str(folder)]
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
    if done.returncode != 0 or "facts" not in answer:
        reason = answer.get("error", "its process ended")
        if not answer.get("ours"):
            reason = f"it is damaged, or of a kind that {library} cannot read: {reason.replace(str(folder), '')}"
        raise FormatError(shorten(reason, 300))
    return answer["facts"]


def _contents(found: MeshFile) -> tuple[dict[str, Any], dict[str, Any]]:
    """A mesh file as facts and arrays."""
    named = {"node": found.node_sets, "cell": found.cell_sets}
    sets = {f"{kind}_{k}": rows for kind, own in named.items() for k, rows in enumerate(own.values())}
    facts = {kind: list(own) for kind, own in named.items()}
    return facts | {"notes": list(found.notes), "up": found.up}, {**found.soup._asdict(), **sets}


def main(library: str, function: str, path: Path, folder: Path, limits: tuple[int, float, int]) -> int:
    """Read the file; in the folder are then `answer.json` and the arrays. Returns 0, or 1 where the answer is an error.

    limits : memory [bytes], time [s], the number of the process with which this one ends
    """
    memory, seconds, parent = limits
    end_with_parent(parent)
    limit_process(seconds, memory)
    # NumPy warns where a text ends before the numbers that it should have.
    warnings.simplefilter("error", DeprecationWarning)
    answer: dict[str, Any] = {}
    try:
        module = importlib.import_module(f"supple.mesh.io.libraries.{library}")
        if function == "read_file":
            facts, arrays = _contents(module.read_file(path))
        else:
            facts, arrays = module.read_series(path, folder / "positions.npy")
        np.savez(folder / "arrays.npz", **arrays)
        answer["facts"] = facts
    except FormatError as error:
        answer = {"error": error.reason, "ours": True}
    except MemoryError:
        answer = {"error": f"it needs more than {memory >> 20} MiB"}
    except OSError as error:  # of its own files: what it reads is there
        answer = {"disk": error.strerror or str(error)}
    except (Exception, SystemExit) as error:  # of any kind: the library trusts its file
        answer = {"error": " ".join(f"{type(error).__name__}: {error}".split())}
    (folder / "answer.json").write_text(json.dumps(answer), "utf-8")
    return 0 if "facts" in answer else 1


if __name__ == "__main__":
    _, _library, _function, _path, _folder_name, *_limits = sys.argv
    _limited = int(_limits[0]), float(_limits[1]), int(_limits[2])
    sys.exit(main(_library, _function, Path(_path), Path(_folder_name), _limited))
