"""Four scenes in Newton, MuJoCo flex, PyBullet, SuperDex and Supple, all judged by `supple check`.

usage: python -m benchmarks.checked_results [FOLDER]     (the results stay in the folder, with `supple check` on each)
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

import supple as sp
from benchmarks.measuring import PEERS_PYTHON, SUPERDEX_PYTHON, peers_installed, run_json
from benchmarks.publishing import publish
from benchmarks.table import Table
from supple.results.check.checker import check_series
from supple.results.check.series import SeriesMetadata

PEERS = Path(__file__).parent / "peers"
sys.path.insert(0, str(PEERS))
scenes: Any = import_module("checked_scenes")


def ours(solver: Any) -> Callable[[str, Path], dict[str, str]]:
    """Simulates a scene with a solver, and writes the frames as the other programs do."""

    def run(name: str, out: Path) -> dict[str, str]:
        own = scenes.scene(name)
        material = sp.StableNeoHookean(youngs=scenes.YOUNGS, poisson=scenes.POISSON, density=scenes.DENSITY)
        parts = list(own.bodies())
        meshes = [sp.TetMesh(x, tets) for x, _, tets in parts]
        bodies = [sp.Body(f"body{k}", mesh, material, friction=0.5) for k, mesh in enumerate(meshes)]
        floor = [sp.HalfSpace(point=(0, 0, 0), normal=(0, 0, 1), friction=0.5)] if own.floor else []
        scene = sp.Scene(bodies, floor, gravity=(0, 0, own.gravity))
        start = {body.name: v for body, (_, v, _) in zip(bodies, parts, strict=True)}
        frames, status = [own.points], "converged"
        for frame in sp.simulate(scene, solver, 1 / scenes.FPS, scenes.FRAMES, initial_velocities=start):
            if frame.index == 0:
                continue
            frames.append(np.concatenate([frame.positions[body.name] for body in bodies]))
            if str(frame.report.status) != "converged":
                status = str(frame.report.status)
        scenes.save(out, frames, own, scenes.lumped_masses(own))
        return {"version": sp.__version__ if status == "converged" else f"{sp.__version__}, {status}"}

    return run


def theirs(script: str, *arguments: str, python: Path = PEERS_PYTHON) -> Callable[[str, Path], dict[str, str]]:
    """Runs a script in the environment of the other programs."""
    return lambda name, out: run_json(python, PEERS / script, name, *arguments, out)


def main(folder: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Print the table; returns its figures, and those of the short one."""
    programs = {
        "Newton XPBD": theirs("checked_newton.py", "xpbd"),
        "Newton VBD": theirs("checked_newton.py", "vbd"),
        "MuJoCo flex": theirs("checked_mujoco.py"),
        "PyBullet": theirs("checked_pybullet.py"),
        "SuperDex": theirs("checked_superdex.py", python=SUPERDEX_PYTHON),
        "Supple XPBD": ours(sp.XPBD()),
        "Supple Implicit": ours(sp.Implicit()),
    }
    columns = {"scene": "", "program": "", "verdict": "", "volume": ".1%", "energy": ".1%"}
    table = Table(f"{scenes.FRAMES + 1} frames each; the largest change of volume, and gain of energy", columns)
    short: dict[str, list[str]] = {name: [] for name in programs}
    for name in scenes.NAMES:
        own = scenes.scene(name)
        given = SeriesMetadata(
            scenes.DENSITY, scenes.YOUNGS, scenes.POISSON, (0.0, 0.0, own.gravity), free=not own.floor
        )
        for program, run in programs.items():
            if program == "PyBullet" and not own.floor:  # it has no velocities of points at the start
                short[program].append("cannot run")
                continue
            out = folder / f"{name}_{program.lower().replace(' ', '_')}.npz"
            about = run(name, out)
            # MuJoCo's tets have the law of St. Venant and Kirchhoff.
            law = "st_venant_kirchhoff" if program == "MuJoCo flex" else given.law
            report = check_series(out, replace(given, law=law))
            failed = ", ".join(result.name for result in report.failures)
            measured = (report["volume"].worst, report["energy"].worst)
            table.add(name, f"{program} {about['version']}", failed or "passes", *measured)
            short[program].append(failed or "passes")
    brief = table.figures() | {
        "columns": dict.fromkeys(("program", *scenes.NAMES), ""),
        "rows": [[program, *cells] for program, cells in short.items()],
    }
    return table.figures(), brief


def run() -> None:
    """Measure, and write the tables of "Check your simulator" and of README.md."""
    if not (peers_installed() and SUPERDEX_PYTHON.exists()):
        sys.exit("the other programs are not installed; run `make peers`, which installs them")
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        whole, brief = main(folder)
    publish("checked_results", whole)
    publish("checked_results_short", brief)


if __name__ == "__main__":
    run()
