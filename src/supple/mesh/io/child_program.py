"""The program of the child process in which a library reads a file; see `in_child`."""

from __future__ import annotations

import importlib
import json
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from supple.mesh.io.cells import FormatError
from supple.runtime.memory import end_with_parent, limit_process


def main(library: str, path: Path, memory: int, seconds: float, parent: int) -> int:
    """Read the file; beside it are then `answer.json` and the arrays. Returns 0, or 1 where the answer is an error."""
    end_with_parent(parent)
    limit_process(seconds, memory)
    # NumPy warns where a text ends before the numbers that it should have.
    warnings.simplefilter("error", DeprecationWarning)
    answer: dict[str, Any] = {}
    try:
        found = importlib.import_module(f"supple.mesh.io.libraries.{library}").read_file(path)
        named = {"node": found.node_sets, "tet": found.tet_sets}
        sets = {f"{kind}_{k}": rows for kind, own in named.items() for k, rows in enumerate(own.values())}
        np.savez(path.with_name("arrays.npz"), **found.soup._asdict(), **sets)
        answer["sets"] = {kind: list(own) for kind, own in named.items()}
    except FormatError as error:
        answer = {"error": error.reason, "ours": True}
    except MemoryError:
        answer = {"error": f"it needs more than {memory >> 20} MiB"}
    except OSError as error:  # of its own files: what it reads is there
        answer = {"disk": error.strerror or str(error)}
    except (Exception, SystemExit) as error:  # of any kind: the library trusts its file
        answer = {"error": " ".join(f"{type(error).__name__}: {error}".split())}
    path.with_name("answer.json").write_text(json.dumps(answer), "utf-8")
    return 0 if "sets" in answer else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4]), int(sys.argv[5])))
