"""Constraint projections and damping of two versions of Supple: `python -m benchmarks.projections_against OTHER/src`.

The two versions run in turn, each in processes of its own, on one thread and on the same mesh; the fastest round of
each is reported. Rows: nanoseconds per constraint of a sweep, and per tet of a substep without and with damping.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import supple as sp
from supple.materials.material import Material
from supple.model.system import build_system, initial_state
from supple.solvers.xpbd.solver import XPBD

DIVISIONS = 17
H = 1.0 / 1200.0
REPEATS = 20


def scene(material: Material) -> sp.Scene:
    """A box that hangs from its top."""
    mesh = sp.shapes.box((1.0, 1.0, 1.0), (DIVISIONS,) * 3)
    top = np.flatnonzero(mesh.vertices[:, 1] > mesh.vertices[:, 1].max() - 1e-9)
    return sp.Scene([sp.Body("box", mesh, material)], pins=[sp.Pin("box", top)])


def sweeps(material: Material) -> dict[str, float]:
    """Nanoseconds per constraint of each set."""
    ws = XPBD(threads=1, contact=None).prepare(build_system(scene(material)))
    taken = {}
    for constraints in ws.sets:
        ws.points[:, :3] = ws.system.rest_positions * 1.001

        def run(project=constraints.project) -> None:
            project(ws.points, H, False)

        taken[type(constraints).__name__] = 1e9 * fastest(run) / constraints.count
    return taken


def substep(damping: float) -> float:
    """Nanoseconds per tet of a substep."""
    system = build_system(scene(sp.StableNeoHookean(youngs=1e5, poisson=0.4, damping=damping)))
    solver = XPBD(threads=1, contact=None)
    workspace = solver.prepare(system)
    state, _ = solver.step(system, initial_state(system.scene), 20 * H, workspace)
    return 1e9 * fastest(lambda: (solver.step(system, state, 20 * H, workspace), None)[1]) / 20 / len(system.tets)


def fastest(run: Callable[[], None]) -> float:
    """Seconds of the fastest of `REPEATS` calls."""
    run()
    best = np.inf
    for _ in range(REPEATS):
        began = time.perf_counter()
        run()
        best = min(best, time.perf_counter() - began)
    return best


def measure() -> dict[str, float]:
    """All rows for the version that is imported."""
    rows = {**sweeps(sp.StableNeoHookean(youngs=1e5, poisson=0.4)), **sweeps(sp.EdgesAndVolume(edge_compliance=1e-5))}
    return {**rows, "substep": substep(0.0), "substep, tau = 0.05 s": substep(0.05)}


def main(other: Path, rounds: int = 3) -> None:
    """Print the table."""
    best: list[dict[str, float]] = [{}, {}]
    for _ in range(rounds):
        for version, source in zip(best, (other, Path(sp.__file__).parents[1]), strict=True):
            environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(source), os.getcwd()])}
            command = [sys.executable, "-m", "benchmarks.projections_against", "--measure"]
            done = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)
            for name, value in json.loads(done.stdout).items():
                version[name] = min(value, version.get(name, np.inf))
    print(f"{'[ns]':>32}  {'other':>8}  {'this':>8}  {'ratio':>6}")
    for name, ours in best[1].items():
        print(f"{name:>32}  {best[0][name]:8.1f}  {ours:8.1f}  {best[0][name] / ours:6.2f}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("other", nargs="?", type=Path, help="the `src` folder of the other version")
    parser.add_argument("--measure", action="store_true", help="only print the rows of the imported version, as JSON")
    arguments = parser.parse_args()
    if arguments.measure:
        print(json.dumps(measure()))
    elif arguments.other is None:
        parser.error("give the `src` folder of the other version")
    else:
        main(arguments.other.resolve())
