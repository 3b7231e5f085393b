"""The demo `bears` on two versions: `python -m benchmarks.bears_against OTHER/src [--substeps 40 640] [--frames 60]`.

A bear has 1,682 tets here. This version runs with its default solver, the other one with each of the numbers of
substeps. Each run has a process of its own, one after the other. Rows: milliseconds a frame without the first, which
compiles; frames in which surfaces cross, by this version's test of triangles against edges; the smallest J. Crossings
and J need no quiet machine.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from supple.app.demos.bears import BEARS, HEIGHT
from supple.mesh.shapes import gummy_bear
from supple.model.system import build_system
from supple.solvers.xpbd.assessment.surfaces import SurfaceCheck, crossings
from supple.solvers.xpbd.contact.contact import mean_edge_length
from supple.solvers.xpbd.solver import XPBD

ROOT = Path(__file__).parents[1]

# Runs in any version since 0.1.
RUN = """
import dataclasses, sys
import numpy as np, supple as sp
from supple.app.demos.bears import BEARS
substeps, frames, file = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
mesh = sp.shapes.gummy_bear(height=0.1, edge_length=0.009)
scene = BEARS.scene()
scene = dataclasses.replace(scene, bodies=[dataclasses.replace(body, mesh=mesh) for body in scene.bodies])
solver = BEARS.solver() if callable(BEARS.solver) else BEARS.solver
if substeps:
    solver = dataclasses.replace(solver, substeps=substeps)
run = list(sp.simulate(scene, solver, BEARS.dt, frames))
seconds = [frame.report.wall_seconds for frame in run[1:]]
J = min(frame.report.min_det_F for frame in run)
np.savez(file, x=np.array([frame.state.positions for frame in run]), seconds=np.mean(seconds), J=J)
"""


def measured(package: Path, substeps: int, frames: int) -> tuple[float, int, float]:
    """Seconds a frame, the number of frames with crossings, and the smallest J; substeps : 0 for the default solver."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "run.npz"
        command = [sys.executable, "-c", RUN, str(substeps), str(frames), str(file)]
        subprocess.run(command, check=True, env={**os.environ, "PYTHONPATH": str(package)}, cwd=package)
        with np.load(file) as run:
            x, seconds, J = run["x"], float(run["seconds"]), float(run["J"])
    mesh, scene = gummy_bear(height=HEIGHT, edge_length=0.009), BEARS.scene()
    system = build_system(replace(scene, bodies=[replace(body, mesh=mesh) for body in scene.bodies]))
    check = SurfaceCheck(system, XPBD().contact, mean_edge_length(system))
    crossed = sum(crossings(check.find(np.ascontiguousarray(item), k * BEARS.dt)) > 0 for k, item in enumerate(x))
    return seconds, crossed, J


def main(other: Path, substeps: list[int], frames: int) -> None:
    """Print a row for each run."""
    print(f"{'bears':<24}{'ms a frame':>11}{'crossing':>16}{'smallest J':>12}")
    rows = [("this version", ROOT / "src", 0)] + [(f"other, {n} substeps", other, n) for n in substeps]
    for name, package, n in rows:
        seconds, crossed, J = measured(package, n, frames)
        print(f"{name:<24}{1e3 * seconds:>11.0f}{f'{crossed} of {frames}':>16}{J:>12.2f}", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("other", type=Path, help="the folder src of another checkout")
    parser.add_argument("--substeps", type=int, nargs="+", default=[40, 640])
    parser.add_argument("--frames", type=int, default=60)
    given = parser.parse_args()
    main(given.other.resolve(), given.substeps, given.frames)
