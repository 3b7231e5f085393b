"""Processor time of a Newton iteration in small implicit scenes, on one thread.

usage: python -m benchmarks.small_scenes [SCENE ...] [--against PATH] [--rounds N] [--profile]

SCENE is `slope`, `stack`, `rollers` or `beam`; all of them without any. A scene takes its warm-up steps first, which
load the compiled kernels; the steps after them are measured. With --against, the package of another checkout, whose
folder `src` is PATH, and this one run in alternation, N times each. The smallest time of each is given, and the ratio.
"""

from __future__ import annotations

import argparse
import cProfile
import json
import os
import pstats
import subprocess
import sys
from pathlib import Path
from time import process_time
from typing import Any, NamedTuple

import numpy as np
from tests.torture.registry import TORTURE

import supple as sp
from benchmarks.table import Table
from supple.model.system import build_system, initial_state

ROOT = Path(__file__).resolve().parents[1]


class Case(NamedTuple):
    """A scene, the length of a step [s], and the numbers of steps before and in the measurement."""

    scene: sp.Scene
    dt: float
    warm: int
    steps: int


def _cubes(count: int, youngs: float, **world: object) -> sp.Scene:
    cube = sp.shapes.box((0.1, 0.1, 0.1), (2, 2, 2))
    rubber = sp.StableNeoHookean(youngs=youngs, poisson=0.4, density=1000.0)
    bodies = [
        sp.Body(f"cube {k}", cube, rubber, position=(0, 0.051 + 0.102 * k, 0), friction=0.3) for k in range(count)
    ]
    return sp.Scene(bodies, [sp.HalfSpace(friction=0.3)], **world)  # pyright: ignore[reportArgumentType]


def slope() -> Case:
    """One cube of 48 tets that slides down a slope of 30 degrees, mu = 0.3."""
    tilted = 9.81 * np.array([np.sin(np.radians(30.0)), -np.cos(np.radians(30.0)), 0.0])
    return Case(_cubes(1, 1e6, gravity=tilted), 1 / 100, 20, 60)


def stack() -> Case:
    """Two cubes of 48 tets on a floor, mu = 0.3."""
    return Case(_cubes(2, 1e5), 1 / 100, 20, 40)


def rollers() -> Case:
    """A ball of about 1,300 tets that rollers pull through a gap."""
    demo = TORTURE["rollers"].full
    assert demo is not None
    return Case(demo.scene(), demo.dt, 8, 12)


def beam() -> Case:
    """A beam of 1,296 tets that hangs from one end; nothing touches."""
    mesh = sp.shapes.box((0.9, 0.1, 0.1), (24, 3, 3))
    body = sp.Body("beam", mesh, sp.StableNeoHookean(youngs=1e6, poisson=0.4, density=1000.0))
    held = np.flatnonzero(mesh.vertices[:, 0] < mesh.vertices[:, 0].min() + 1e-9)
    return Case(sp.Scene([body], pins=[sp.Pin("beam", vertices=held)]), 1 / 60, 5, 20)


CASES = {"slope": slope, "stack": stack, "rollers": rollers, "beam": beam}


def measured(name: str, profile: bool = False) -> dict[str, float]:
    """Processor time of the measured steps by their Newton iterations."""
    case = CASES[name]()
    solver = sp.Implicit()
    system = build_system(case.scene)
    workspace = solver.prepare(system)
    state = initial_state(case.scene)
    profiler = cProfile.Profile()
    spent, iterations, converged = 0.0, 0, True
    for k in range(case.warm + case.steps):
        if k == case.warm and profile:
            profiler.enable()
        began = process_time()
        state, report = solver.step(system, state, case.dt, workspace)
        if k >= case.warm:
            spent += process_time() - began
            iterations += report.iterations
            converged &= report.status == "converged"
    profiler.disable()
    if profile:
        statistics = pstats.Stats(profiler)
        statistics.sort_stats("tottime").print_stats(45)
        print(f"{name}: {iterations} iterations")
    digest = float(np.abs(state.positions).sum())
    return {
        "tets": len(system.tets),
        "steps": case.steps,
        "iterations": iterations,
        "ms": 1e3 * spent / iterations,
        "converged": converged,
        "digest": digest,
    }


def in_process(name: str, package: Path) -> dict[str, float]:
    """`measured` in a new process on one thread that imports supple from the folder `package`."""
    code = "import json, sys; from benchmarks.small_scenes import measured; print(json.dumps(measured(sys.argv[1])))"
    paths = os.pathsep.join([str(package), str(ROOT)])
    environment = {**os.environ, "PYTHONPATH": paths, "NUMBA_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    done = subprocess.run([sys.executable, "-c", code, name], capture_output=True, text=True, env=environment)
    if done.returncode != 0:
        raise SystemExit(f"{name} failed on {package}:\n{done.stderr[-2000:]}")
    return json.loads(done.stdout.strip().splitlines()[-1])


def main(names: list[str], against: str | None, rounds: int) -> dict[str, Any]:
    """Print the table; returns its figures."""
    packages = [ROOT / "src"] + ([Path(against).resolve()] if against is not None else [])
    columns = {"scene": "", "tets": ",.0f", "Newton/step": ".1f", "ms/iteration": ".2f"}
    other = {"other": ".2f", "ratio": ".2f", "results": ""} if against is not None else {}
    table = Table("Processor time of an iteration of Newton's method", columns | other, threads=1)
    for name in names or CASES:
        runs = [[in_process(name, package) for package in packages] for _ in range(rounds)]
        best = [min(runs[r][p]["ms"] for r in range(rounds)) for p in range(len(packages))]
        first = runs[0][0]
        cells: list[Any] = [name, first["tets"], first["iterations"] / first["steps"], best[0]]
        if against is not None:
            same = all(runs[0][1][key] == first[key] for key in ("digest", "iterations"))
            cells += [best[1], best[1] / best[0], "same" if same else "differ"]
        table.add(*cells)
        if not first["converged"]:
            table.note(f"Not every step of {name} converged.")
    table.note("The targets are 0.4 ms with 50 tets, and 3 ms with 1,300.")
    return table.figures()


def run() -> None:
    """Measure, and print the table."""
    main([], None, 3)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE")
    parser.add_argument("--against", metavar="PATH", help="the folder src of another checkout")
    parser.add_argument("--rounds", type=int, default=3, metavar="N")
    parser.add_argument("--profile", action="store_true", help="of Python, in this process")
    given = parser.parse_args()
    if given.profile:
        for item in given.scenes or CASES:
            measured(item, profile=True)
    elif given == parser.parse_args([]):
        run()
    else:
        main(given.scenes, given.against, given.rounds)
