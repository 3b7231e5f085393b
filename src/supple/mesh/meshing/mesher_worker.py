"""The program of the child process: a mesher, MeshFix or decimation on arrays from a file, within limits.

It is started by its path, not imported. It uses only NumPy and the mesher, so that it starts quickly and so that no
part of the parent's program runs a second time. Job and answer are `.npz` and `.json` files in a folder.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from supple.runtime.memory import end_with_parent, limit_process

# TetGen's smoothing leaves some tets up to half as large again as the bound that its refinement kept.
VOLUME_ATTEMPTS = 5


def main(folder: Path) -> int:
    """Run the job in `folder`; returns 0, or 1 where `answer.json` has the error, or as "disk" that of a file."""
    job: dict[str, Any] = json.loads((folder / "job.json").read_text("utf-8"))
    end_with_parent(job["parent"])
    answer: dict[str, Any] = {"notes": limit_process(job["cpu_seconds"], job["memory_limit"])}
    started = time.perf_counter()
    code = 0
    try:
        import numpy as np

        with np.load(folder / "surface.npz") as surface:
            vertices, triangles = surface["vertices"], surface["triangles"]
        runs = {
            "tetgen": _run_tetgen,
            "ftetwild": _run_ftetwild,
            "meshfix": _run_meshfix,
            "decimation": _run_decimation,
        }
        run = runs[job["mesher"]]
        points, elements, labels = run(vertices, triangles, job["options"], answer["notes"])
        with (folder / "mesh.npz").open("wb") as file:
            np.savez(file, vertices=points, elements=elements, labels=labels)
    except MemoryError:
        answer["error"], code = "out of memory", 1
    except OSError as error:
        answer["disk"], code = error.strerror or str(error), 1
    except Exception as error:
        text = " ".join(str(error).split())
        answer["error"], code = text if isinstance(error, RuntimeError) else f"{type(error).__name__}: {text}", 1
    answer["seconds"] = time.perf_counter() - started
    (folder / "answer.json").write_text(json.dumps(answer), "utf-8")
    return code


def _run_tetgen(vertices: Any, triangles: Any, options: dict[str, Any], notes: list[str]) -> tuple[Any, Any, Any]:
    """Tets and the region each belongs to (regions are what the surface separates, cavities among them)."""
    import tetgen

    def run(bound: float | None) -> tuple[Any, Any, Any]:
        points, tets, regions, _ = tetgen.TetGen(vertices, triangles).tetrahedralize(
            quality=options["quality"] is not None,
            minratio=options["quality"] or 2.0,
            mindihedral=options["min_dihedral"] or 0.0,
            # The default, 177, leaves boundary tets of about one degree; 165 flips most of them away at no cost.
            optmaxdihedral=165.0,
            nobisect=options["keep_surface"],
            fixedvolume=bound is not None,
            maxvolume=-1.0 if bound is None else bound,
            # Time and memory limit the work. TetGen's own limit of 100 000 points would end it without a message.
            steinerleft=-1,
            regionattrib=True,
            quiet=True,
        )
        return points, tets, regions.reshape(-1)

    return _below_volume(run, options["max_volume"], options["max_volume"], notes)


def _run_ftetwild(vertices: Any, triangles: Any, options: dict[str, Any], notes: list[str]) -> tuple[Any, Any, Any]:
    import numpy as np
    from pytetwild.pytetwild import tetrahedralize

    def run(bound: float | None) -> tuple[Any, Any, Any]:
        # A regular tet of edge a has the volume a^3 / (6 sqrt 2).
        edge_length = None if bound is None else (6.0 * np.sqrt(2.0) * bound) ** (1.0 / 3.0)
        points, tets = tetrahedralize(
            vertices,
            triangles,
            edge_length_abs=edge_length,
            epsilon=options["envelope"],
            num_threads=options["threads"],
            # Without this, tets come out negative.
            vtk_ordering=True,
            quiet=True,
        )
        return points, tets, np.ones(len(tets))

    # The edge length is a target for the mean: the largest tets have up to twice the volume.
    max_volume = options["max_volume"]
    return _below_volume(run, max_volume, None if max_volume is None else 0.5 * max_volume, notes)


def _run_meshfix(vertices: Any, triangles: Any, options: dict[str, Any], notes: list[str]) -> tuple[Any, Any, Any]:
    """Each component in `options["faulty"]` alone; no triangles for one of which MeshFix keeps nothing."""
    import numpy as np
    import pymeshfix

    component = np.asarray(options["components"])
    points, faces, labels, start = [np.empty((0, 3))], [np.empty((0, 3), np.int32)], [np.empty(0)], 0
    for k in options["faulty"]:
        used, local = np.unique(triangles[component == k], return_inverse=True)
        fixer = pymeshfix.MeshFix(vertices[used], local.reshape(-1, 3).astype(np.int32), verbose=False)
        # One component has no smaller one to drop, except for what the repair itself cuts off.
        fixer.repair(joincomp=False, remove_smallest_components=False)
        points.append(np.asarray(fixer.points, dtype=np.float64).reshape(-1, 3))
        faces.append(np.asarray(fixer.faces, dtype=np.int32).reshape(-1, 3) + start)
        labels.append(np.full(len(faces[-1]), float(k)))
        start += len(points[-1])
    return np.concatenate(points), np.concatenate(faces), np.concatenate(labels)


def _run_decimation(vertices: Any, triangles: Any, options: dict[str, Any], notes: list[str]) -> tuple[Any, Any, Any]:
    import fast_simplification
    import numpy as np

    # The library collapses all edges below an error that grows the faster, the more aggressive it is: with its default
    # alone, a box of 1,584 triangles that lies at an angle loses a third of its volume on the way to 100.
    for aggressiveness in range(options["first"], 10):
        if len(triangles) <= options["triangles"]:
            break
        reduced = fast_simplification.simplify(
            vertices, triangles, target_count=options["triangles"], agg=float(aggressiveness)
        )
        vertices, triangles = reduced[0], reduced[1]
    return vertices, triangles, np.ones(len(triangles))


def _below_volume(
    run: Callable[[float | None], tuple[Any, Any, Any]], max_volume: float | None, bound: float | None, notes: list[str]
) -> tuple[Any, Any, Any]:
    """The mesher's result; it runs again with a tighter bound while its largest tet exceeds `max_volume`."""
    import numpy as np

    answer = run(bound)
    if max_volume is None or bound is None:
        return answer
    for _ in range(VOLUME_ATTEMPTS - 1):
        if len(answer[1]) == 0:
            break
        corners = answer[0][answer[1]]
        largest = float(np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])).max() / 6.0)
        if largest <= max_volume * (1.0 + 1e-9):
            break
        notes.append(f"the largest tet is {largest / max_volume:.3g} times max_volume; trying a tighter bound")
        bound *= max(0.25, 0.98 * max_volume / largest)
        answer = run(bound)
    return answer


if __name__ == "__main__":
    exit_code = main(Path(sys.argv[1]))
    sys.stdout.flush()
    sys.stderr.flush()
    # Without the meshers' global destructors, which are known to crash after the work is done.
    os._exit(exit_code)
