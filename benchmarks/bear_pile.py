"""Cost of implicit steps of piles of 5 to 100 gummy bears: time, memory, and the exponents of growth.

usage: python -m benchmarks.bear_pile [COUNT ...]

Bears of 1,575 tets, each squeezed to .72 of its extents, fill a bin without a lid and expand. Times are those of the
processor, of two steps: in the first the pile expands, and compiled kernels are loaded. `supple check` tests the last
state for intersections and inverted tets. Every pile has a process of its own: `--one COUNT` prints one line of JSON.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import supple as sp
from benchmarks.measuring import run_json
from benchmarks.our_beam import peak_megabytes
from benchmarks.table import Table
from supple.results.check.checker import check_recording
from supple.solvers.implicit.details import ImplicitDetails

COUNTS = (5, 10, 20, 40, 100)
SIDES = {5: (5, 1, 1), 10: (5, 2, 1), 20: (5, 2, 2), 40: (5, 4, 2), 100: (5, 4, 5)}
SQUEEZE = 0.72  # of the extents of a bear
DHAT = 2.5e-3  # [m] a quarter of an edge
NEAR = 0.75  # of dhat: gaps between squeezed bears, which then press on each other about as on the walls before
STEP, STEPS = 1 / 60, 2
RUBBER = sp.StableNeoHookean(youngs=3e4, poisson=0.3, density=1100.0)
SOLVER = sp.Implicit(contact=sp.IPCContact(dhat=DHAT))


def bin_around(
    low: NDArray[np.float64], high: NDArray[np.float64], way: float = 0.0, lid: bool = False
) -> list[sp.HalfSpace]:
    """Half-spaces around a cuboid; in a second they close in by a share `way` of its extents."""
    walls = []
    for k in range(3):
        for side, point in ((1.0, low), (-1.0, high)):
            if k == 1 and side < 0 and not lid:
                continue
            normal = side * np.eye(3)[k]
            motion = sp.Keyframes([0.0, 1.0], displacements=[(0, 0, 0), tuple(0.5 * way * (high - low) * normal)])
            walls.append(sp.HalfSpace(point=point, normal=normal, friction=0.4, motion=motion if way else None))
    return walls


def squeezed() -> tuple[sp.TetMesh, NDArray[np.float64], NDArray[np.float64]]:
    """A bear, where its vertices are in the cuboid, about its center (n, 3), and the cuboid's extents [m]."""
    mesh = sp.shapes.gummy_bear(height=0.1, edge_length=0.0095)
    low, high = mesh.vertices.min(axis=0) - DHAT, mesh.vertices.max(axis=0) + DHAT
    walls = bin_around(low, high, 1.0 - SQUEEZE, lid=True)
    scene = sp.Scene([sp.Body("bear", mesh, RUBBER)], walls, gravity=(0, 0, 0))
    *_, last = sp.simulate(scene, SOLVER, 1 / 10, 10)
    return mesh, last.positions["bear"] - 0.5 * (low + high), np.ptp(last.positions["bear"], axis=0)


def pile(count: int) -> tuple[sp.Scene, dict[str, NDArray[np.float64]]]:
    """The scene, and where its vertices are; every other bear is turned by half a turn about the vertical."""
    mesh, x, size = squeezed()
    pitch, sides = size + NEAR * DHAT, SIDES[count]
    bodies, places = [], {}
    for k, cell in enumerate(np.ndindex(sides)):
        turn = np.array([1, 1, 1]) if sum(cell) % 2 else np.array([-1, 1, -1])
        bodies.append(sp.Body(f"bear{k}", mesh, RUBBER, friction=0.4))
        centered = turn * x
        centered -= 0.5 * (centered.min(axis=0) + centered.max(axis=0))
        places[bodies[-1].name] = centered + pitch * (np.array(cell) + 0.5)
    return sp.Scene(bodies, bin_around(np.zeros(3), pitch * sides)), places


def one(count: int) -> dict[str, Any]:
    """The steps of one pile."""
    scene, places = pile(count)
    counts: list[tuple[float, int, int, int]] = []
    statuses, tets = set(), 0
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "pile.vtkhdf"
        frames = sp.simulate(scene, SOLVER, STEP, STEPS, initial_positions=places, sinks=[sp.Recorder(path)])
        begin = time.process_time()
        for frame in frames:
            details = frame.report.details
            assert isinstance(details, ImplicitDetails)
            seconds = time.process_time() - begin
            counts.append((seconds, details.contacts, details.newton_iterations, details.cg_iterations))
            statuses.add(str(frame.report.status))
            tets = len(frame.system.tets)
            begin = time.process_time()
        peak = peak_megabytes()
        checked = check_recording(path, only=("intersection", "inversion", "containment", "obstacles"))
    return {
        "tets": tets,
        "steps": counts,
        "peak_MB": peak,
        "statuses": ", ".join(sorted(statuses)),
        "failures": [result.message for result in checked.failures],
    }


def main(counts: Sequence[int] = COUNTS) -> dict[str, Any]:
    """Print the table, and the exponents of both steps; returns the figures."""
    columns = {"bears": "d", "tets": ",d", "step": "d", "contacts": ",d", "Newton": "d", "CG": ",d", "seconds": ".1f"}
    columns |= {"peak, MB": ".0f", "statuses": "", "`supple check`": ""}
    table = Table("Implicit steps of piles of bears; seconds of the processor", columns, threads=1)
    times = []
    for count in counts:
        found = run_json(sys.executable, "benchmarks.bear_pile", "--one", count, threads=1)
        for k, (seconds, *numbers) in enumerate(found["steps"]):
            end = [found["peak_MB"], found["statuses"], "; ".join(found["failures"]) or "passed"]
            table.add(count, found["tets"], k + 1, *numbers, seconds, *(end if k + 1 == STEPS else [None] * 3))
        times.append([(seconds, seconds / newton) for seconds, _, newton, _ in found["steps"]])
    if len(counts) > 1:
        growth = np.polyfit(np.log(counts), np.log(times).reshape(len(counts), -1), 1)[0].reshape(STEPS, 2)
        said = [f"step {k + 1} {whole:.2f}, an iteration of it {item:.2f}" for k, (whole, item) in enumerate(growth)]
        table.note(f"Exponents of growth in the number of bears: {'; '.join(said)} (target of an iteration: 1.15).")
    return table.figures()


def run() -> None:
    """Measure the three smallest piles, and print the table."""
    main(COUNTS[:3])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "counts", nargs="*", type=int, metavar="COUNT", help="of 5, 10, 20, 40, 100; without it, 5 to 20 are written"
    )
    parser.add_argument("--one", type=int, choices=COUNTS, help="one pile in this process")
    chosen = parser.parse_args()
    if chosen.one is not None:
        print(json.dumps(one(chosen.one)))
    elif chosen.counts:
        main(chosen.counts)
    else:
        run()
