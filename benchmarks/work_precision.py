"""The hanging beam after 1/3 s: error against time of the processor, each solver against its own refined reference.

usage: python -m benchmarks.work_precision [--quick] [--scale SCALE] [--threads N]

Every solver has its own mesh and material model, so a comparison of positions between solvers would measure those.
Here each is held against itself in the limit of small steps: positions at t = 1/3 s, RMS over all vertices, relative to
the mean displacement of the free end. Nobody looks for contacts of the beam with itself. Supple's two solvers share
mesh and material: their limits are compared too.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.measuring import PEERS_PYTHON, alternate, peers_installed, run_json
from benchmarks.publishing import publish
from benchmarks.table import Table

HERE = Path(__file__).parent
FRAMES = 20

# A run receives the path of the file for its positions, and returns what the script printed.
Run = Callable[[Path], dict]


@dataclass(frozen=True)
class Family:
    """One method: its reference run, and typical runs."""

    name: str
    reference: tuple[str, Run]
    programs: dict[str, Run]


@dataclass(frozen=True)
class Row:
    """The time of one program [s], and its error relative to the reference of its family."""

    family: str
    name: str
    seconds: float
    error: float
    note: str = ""

    @property
    def ours(self) -> bool:
        return self.family.startswith("Supple")


def families(scale: int, quick: bool, threads: int | None) -> list[Family]:
    """All programs, on the beam of that scale."""

    def ours(*arguments: object) -> Run:
        return lambda file: run_json(sys.executable, HERE / "our_beam.py", *arguments, FRAMES, file, threads=threads)

    def implicit(per_frame: float, integrator: str, tolerance: float = 0) -> Run:
        return ours("implicit", scale, repr(1 / 60 / per_frame), integrator, tolerance)

    def newton(kind: str, substeps: int, iterations: int) -> Run:
        script = HERE / "peers" / "newton_beam.py"
        return lambda file: run_json(PEERS_PYTHON, script, kind, scale, substeps, iterations, FRAMES, file)

    def mujoco(step: float, integrator: str) -> Run:
        script = HERE / "peers" / "mujoco_beam.py"
        return lambda file: run_json(PEERS_PYTHON, script, scale, repr(step), integrator, FRAMES, file)

    finest = 16 if quick else 32
    return [
        Family(
            "Supple Implicit",
            (f"newmark, {finest} steps a frame", implicit(finest, "newmark", 1e-4)),
            {
                "backward Euler, 1/60 s": implicit(1, "backward_euler"),
                "backward Euler, 1/240 s": implicit(4, "backward_euler"),
                "backward Euler, one linearization, 1/60 s": ours("linearized", scale, 1 / 60, "backward_euler", 0),
                "backward Euler, one linearization, 1/240 s": ours("linearized", scale, 1 / 240, "backward_euler", 0),
                "BDF2, 1/60 s": implicit(1, "bdf2"),
                "BDF2, 1/240 s": implicit(4, "bdf2"),
                "Newmark, 1/60 s": implicit(1, "newmark"),
                "Newmark, 1/240 s": implicit(4, "newmark"),
            },
        ),
        Family(
            "Supple XPBD",
            (
                "1,280 substeps" if quick else "2,560 substeps",
                ours("xpbd_without_contact", scale, 1280 if quick else 2560),
            ),
            {f"{n} substeps": ours("xpbd_without_contact", scale, n) for n in (10, 20, 80, 320)},
        ),
        Family(
            "Newton VBD",
            # With more substeps it does not converge: 80 x 20 differs from 40 x 20 by 4 %, 20 x 20 by much less.
            ("40 x 20", newton("vbd", 40, 20)),
            {f"{n} substeps x {k} iterations": newton("vbd", n, k) for n, k in ((10, 10), (20, 20))},
        ),
        Family(
            "Newton XPBD",
            ("320 x 1" if quick else "640 x 1", newton("xpbd", 320 if quick else 640, 1)),
            {f"{n} substeps x {k} iterations": newton("xpbd", n, k) for n, k in ((20, 1), (160, 1))},
        ),
        Family(
            "MuJoCo flex",
            ("Euler, 1/16 ms", mujoco(1 / 16e3, "Euler")),
            {
                "explicit Euler, 1 ms": mujoco(1e-3, "Euler"),
                "explicit Euler, 1/4 ms": mujoco(1 / 4e3, "Euler"),
                "discrete, 1/60 s": mujoco(1 / 60, "discrete"),
                "discrete, 1 ms": mujoco(1e-3, "discrete"),
            },
        ),
    ]


def relative_error(found: NDArray[np.float64], reference: NDArray[np.float64]) -> float:
    """RMS distance at the end, over the mean displacement of the free end; columns: rest (3), end (3)."""
    rest, end = reference[:, :3], reference[:, 3:]
    tip = rest[:, 0] > rest[:, 0].max() - 1e-4
    moved = np.linalg.norm((end - rest)[tip].mean(axis=0))
    with np.errstate(over="ignore", invalid="ignore"):
        return float(np.sqrt(np.mean(np.sum((found[:, 3:] - end) ** 2, axis=1))) / moved)


def measure(family: Family, rounds: int, folder: Path) -> tuple[list[Row], NDArray[np.float64]]:
    """The fastest round of every program, and the positions of the reference."""
    file = folder / "positions.npy"
    name, run = family.reference
    result = run(file)
    reference = np.load(file)
    rows = []
    for label, program in family.programs.items():
        rounds_said = [program(file) for _ in range(rounds)]
        seconds = min(r["ms_per_frame"] for r in rounds_said) * FRAMES / 1e3
        statuses = [status for status in rounds_said[0].get("statuses", []) if status != "converged"]
        rows.append(Row(family.name, label, seconds, relative_error(np.load(file), reference), ", ".join(statuses)))
    note = f"reference: {name}, {result['ms_per_frame'] * FRAMES / 1e3:.1f} s"
    return [Row(family.name, note, float("nan"), 0.0), *rows], reference


def converged_step(scale: int, threads: int | None) -> str:
    """A converged step of 1/60 s, compared with MuJoCo's `discrete` one."""
    implicit = ("implicit", scale, 1 / 60, "backward_euler", 0, FRAMES)
    programs = {
        "ours": lambda: run_json(sys.executable, HERE / "our_beam.py", *implicit, threads=threads),
        "theirs": lambda: run_json(PEERS_PYTHON, HERE / "peers" / "mujoco_beam.py", scale, 1 / 60, "discrete", FRAMES),
    }
    best = alternate(programs, 3)
    ours, theirs = best["ours"], best["theirs"]
    a, b = ours["ms_per_step"], theirs["ms_per_frame"]
    return (
        f"A step of 1/60 s: Supple Implicit {a:.1f} ms ({ours['tets']} tets, {', '.join(ours['statuses'])}, "
        f"{ours['iterations_per_step']:.1f} Newton iterations), MuJoCo discrete {b:.1f} ms ({theirs['tets']} tets): "
        f"ratio {a / b:.2f}, target at most 2."
    )


def verdict(rows: list[Row]) -> list[str]:
    """Which programs are less accurate at equal time, and the factor over VBD with 10 x 10."""
    rows = [row for row in rows if np.isfinite(row.seconds)]
    ours, said = [row for row in rows if row.ours], []
    for peer in (row for row in rows if not row.ours):
        if not any(row.seconds <= peer.seconds and row.error <= peer.error for row in ours):
            said.append(f"Not beaten at its time: {peer.family}, {peer.name} ({peer.seconds:.3f} s, {peer.error:.2e}).")
    for vbd in (row for row in rows if row.name == "10 substeps x 10 iterations"):
        better = [row for row in ours if row.error <= vbd.error]
        if better:
            best = min(better, key=lambda row: row.seconds)
            said.append(
                f"Newton VBD 10 x 10 against {best.family}, {best.name}: {vbd.seconds / best.seconds:.1f} times slower "
                f"at {vbd.error / best.error:.1f} times the error (target: 10 times)."
            )
    return said


def main(quick: bool = False, scale: int = 1, threads: int | None = 1) -> dict[str, Any]:
    """Print the table; returns its figures."""
    if not peers_installed():
        sys.exit("the peers are not installed; run `make bench`, which does it")
    columns = {"solver": "", "": "", "seconds of the processor": ".3f", "error": ".2e", "not converged": ""}
    table = Table(f"Hanging beam, scale {scale}, after {FRAMES}/60 s", columns, threads)
    all_rows: list[Row] = []
    references = {}
    with tempfile.TemporaryDirectory() as folder:
        for family in families(scale, quick, threads):
            rows, references[family.name] = measure(family, 1 if quick else 2, Path(folder))
            table.note(f"{family.name}: {rows[0].name}")
            for row in rows[1:]:
                table.add(row.family, row.name, row.seconds, row.error, row.note)
            all_rows += rows
    apart = relative_error(references["Supple XPBD"], references["Supple Implicit"])
    table.note(f"The references of Supple Implicit and Supple XPBD are {apart:.2e} of the tip's displacement apart.")
    for said in verdict(all_rows):
        table.note(said)
    table.note(converged_step(2, threads))
    return table.figures()


def run() -> None:
    """Measure, and write the figures of docs/validation/benchmarks.md."""
    publish("work_precision", main())


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="one round, coarser references; nothing is written")
    parser.add_argument("--scale", type=int, default=1, help="1: about 1,000 tets; 2: about 8,000")
    parser.add_argument("--threads", type=int, default=1, help="of Supple")
    chosen = parser.parse_args()
    if chosen == parser.parse_args([]):
        run()
    else:
        main(chosen.quick, chosen.scale, chosen.threads)
