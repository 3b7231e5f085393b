"""Constraint projections per second, compared with plain C: `python -m benchmarks.projections [--quick]`.

All variants run in turn on the same mesh, and the fastest round is reported: processor time where there is one thread,
else wall time. C is compiled in the same run. Columns, and the same for two threads where the machine has them:

    tets         size of the box mesh
    C            edges + volume in plain C, one thread                       [million projections / s]
    1 thread     edges + volume in Supple                                    [million projections / s]
    1 / C        the ratio to C
    ns/tet       time of a sweep over edges and volumes per tet              [ns]
    tets         stable Neo-Hookean tets per second                          [million / s]
    step         edges + volume in complete substeps                         [million projections / s]
"""

from __future__ import annotations

import argparse
import ctypes
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba.core import config
from numpy.ctypeslib import ndpointer

import supple as sp
from benchmarks.table import Table
from supple.model.system import System, build_system, initial_state
from supple.solvers.xpbd.solver import XPBD

DIVISIONS = {"1k": 6, "10k": 12, "30k": 17, "100k": 26, "180k": 31, "1M": 55}
GCC_FLAGS = ("-O3", "-march=native", "-ffast-math", "-shared", "-fPIC")
H = 1.0 / 1200.0


def compile_reference(folder: Path) -> ctypes.CDLL | None:
    """The C kernels, or None where there is no gcc."""
    gcc = shutil.which("gcc")
    if gcc is None:
        return None
    library = folder / "reference.so"
    source = Path(__file__).with_name("gauss_seidel_reference.c")
    subprocess.run([gcc, *GCC_FLAGS, str(source), "-o", str(library), "-lm"], check=True)
    reference = ctypes.CDLL(str(library))
    doubles, ints = ndpointer(np.float64, flags="C"), ndpointer(np.int32, flags="C")
    for function in (reference.project_edges, reference.project_volumes):
        function.argtypes = [doubles, doubles, ints, doubles, ctypes.c_long]
        function.restype = None
    return reference


def reference_sweep(reference: ctypes.CDLL, system: System) -> Callable[[], None]:
    """One sweep of the C kernels over a system, in the mesh's own order."""
    x = system.rest_positions * 1.001
    w, rest = system.inverse_masses, 6.0 * system.rest_volumes

    def sweep() -> None:
        reference.project_edges(x, w, system.edges, system.rest_lengths, len(system.edges))
        reference.project_volumes(x, w, system.tets, rest, len(system.tets))

    return sweep


def our_sweep(system: System, threads: int) -> Callable[[], None]:
    """One sweep of Supple's constraint sets over the same system."""
    solver = XPBD(threads=threads, contact=None)
    ws = solver.prepare(system)
    ws.points[:, :3] = ws.system.rest_positions * 1.001

    def sweep() -> None:
        numba.set_num_threads(threads)
        for constraints in ws.sets:
            constraints.project(ws.points, H, threads > 1)

    return sweep


def our_substep(system: System, threads: int, substeps: int) -> Callable[[], None]:
    """`substeps` whole substeps, including the restoring of momentum."""
    solver = XPBD(threads=threads, contact=None, substeps=substeps)
    workspace = solver.prepare(system)
    state = initial_state(system.scene)
    return lambda: (solver.step(system, state, substeps * H, workspace), None)[1]


def fastest(variants: dict[str, Callable[[], None]], repeats: int, rounds: int) -> dict[str, float]:
    """Seconds of one call of each variant: they run in turn, and the fastest round is returned."""
    for run in variants.values():
        run()
    best = dict.fromkeys(variants, np.inf)
    clock = time.process_time if thread_counts() == [1] else time.perf_counter
    for _ in range(rounds):
        for name, run in variants.items():
            start = clock()
            for _ in range(repeats):
                run()
            best[name] = min(best[name], (clock() - start) / repeats)
    return best


def measure(divisions: int, reference: ctypes.CDLL | None, rounds: int) -> dict[str, float]:
    """All columns for a box of `divisions`^3 cells."""
    mesh = sp.shapes.box((1.0, 1.0, 1.0), (divisions,) * 3)
    classic = build_system(sp.Scene(bodies=[sp.Body("box", mesh, sp.EdgesAndVolume())]))
    neo_hookean = build_system(sp.Scene(bodies=[sp.Body("box", mesh, sp.StableNeoHookean(youngs=1e5, poisson=0.45))]))
    count = len(mesh.edges) + len(mesh.tets)
    repeats = max(1, round(2e6 / count))
    substeps = max(2, min(20, repeats))
    variants: dict[str, Callable[[], None]] = {}
    if reference is not None:
        variants["C"] = reference_sweep(reference, classic)
    for threads in thread_counts():
        variants[f"{threads}"] = our_sweep(classic, threads)
        variants[f"snh {threads}"] = our_sweep(neo_hookean, threads)
        variants[f"step {threads}"] = our_substep(classic, threads, substeps)
    seconds = fastest(variants, repeats, rounds)
    rates = {name: count / s / 1e6 for name, s in seconds.items()}
    for threads in thread_counts():
        rates[f"snh {threads}"] = len(mesh.tets) / seconds[f"snh {threads}"] / 1e6
        rates[f"step {threads}"] *= substeps
        rates[f"ns/tet {threads}"] = 1e9 * seconds[f"{threads}"] / len(mesh.tets)
    return {"tets": len(mesh.tets), **rates}


def thread_counts() -> list[int]:
    """One thread, and two where the machine has them."""
    return [1, 2] if config.NUMBA_NUM_THREADS > 1 else [1]  # pyright: ignore[reportAttributeAccessIssue]


def main(quick: bool = False) -> dict[str, Any]:
    """Print the table; returns its figures."""
    columns = {"cells": "", "tets": ",d", "C": ".1f"}
    for t in thread_counts():
        columns |= {f"{t} thread{'s' * (t > 1)}": ".1f", f"{t} / C": ".2f", f"ns/tet, {t}": ".1f"}
        columns |= {f"Neo-Hookean, {t}": ".1f", f"step, {t}": ".1f"}
    with tempfile.TemporaryDirectory() as folder:
        reference = compile_reference(Path(folder))
        table = Table("Constraint projections, float64, million per second", columns)
        if reference is None:
            table.note("There was no gcc: the columns of C are empty.")
        for size in list(DIVISIONS)[:3] if quick else DIVISIONS:
            row = measure(DIVISIONS[size], reference, rounds=3 if quick else 7)
            cells: list[Any] = [size, row["tets"], row.get("C")]
            for t in thread_counts():
                ratio = row[f"{t}"] / row["C"] if "C" in row else None
                cells += [row[f"{t}"], ratio, row[f"ns/tet {t}"], row[f"snh {t}"], row[f"step {t}"]]
            table.add(*cells)
    return table.figures()


def run() -> None:
    """Measure, and print the table."""
    main()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="small meshes only, few rounds")
    if parser.parse_args().quick:
        main(quick=True)
    else:
        run()
