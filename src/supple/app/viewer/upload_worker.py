"""The child process that reads and meshes an uploaded file, so that a hostile file cannot affect other processes.

Job, file and answer are in one private folder, the current one. The parent keeps a pipe to the standard input open;
when it is closed, this process ends, together with the mesher that it has started.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import sys
import threading
from pathlib import Path
from typing import Any

JOB, ANSWER, MESH = "job.json", "answer.json", "tets.npz"


def main() -> int:
    """Do the job of the current folder; returns the exit code: 0, or 1 where `answer.json` contains an error."""
    from supple.errors import SuppleError
    from supple.runtime.memory import limit_process

    job: dict[str, Any] = json.loads(Path(JOB).read_text("utf-8"))
    limit_process(job["seconds"] + 10.0, job["memory"])
    try:
        _mesh(job)
    except SuppleError as error:
        message = str(error)
    except MemoryError:
        message = f"{job['file']}: it needs more memory than an upload may use; make it smaller"
    else:
        return 0
    Path(ANSWER).write_text(json.dumps({"error": " ".join(message.split())}), "utf-8")
    return 1


def _mesh(job: dict[str, Any]) -> None:
    """Read, scale and mesh the surface, which is repaired where it has faults."""
    import numpy as np

    from supple.errors import MeshError, MeshingError
    from supple.mesh.meshing.tetrahedralize import tetrahedralize
    from supple.mesh.surface import SurfaceMesh

    file, most = job["file"], job["triangles"]
    surface = SurfaceMesh.load(file)
    if len(surface.triangles) > most:
        raise MeshError(f"{file}: {len(surface.triangles)} triangles; an upload may have {most}; make it coarser")
    low, high = surface.bounds
    extent = float((high - low).max())
    if not 0.0 < extent < np.inf:
        raise MeshError(f"{file}: all its vertices are at one point; check the file")
    surface = surface.transformed(1.0, None, -0.5 * (low + high)).transformed(job["size"] / extent)
    options = {"time_limit": job["seconds"], "memory_limit": job["memory"]}
    try:
        mesh = tetrahedralize(surface, tets=job["tets"], repair=True, **options)
    except MeshingError as error:
        raise MeshingError(f"{file}: {error}") from None
    with Path(MESH).open("wb") as out:
        np.savez(out, vertices=mesh.vertices, tets=mesh.tets)


def _end_with_parent() -> None:
    """Wait until the parent closes the standard input, then end this process group."""
    while os.read(0, 1):
        pass
    if hasattr(os, "killpg") and os.getpid() == os.getpgrp():
        os.killpg(0, signal.SIGKILL)
    os._exit(1)


if __name__ == "__main__":
    with contextlib.suppress(AttributeError, OSError):
        os.nice(5)  # the live simulation has priority
    threading.Thread(target=_end_with_parent, daemon=True).start()
    exit_code = main()
    sys.stdout.flush()
    os._exit(exit_code)
