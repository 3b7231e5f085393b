"""The hanging beam in Supple, Newton and MuJoCo flex, alternately: processor ms per frame of 1/60 s on one thread.

usage: python -m benchmarks.hanging_beam
"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.measuring import PEERS_PYTHON, alternate, peers_installed, run_json
from benchmarks.publishing import publish
from benchmarks.table import Table

HERE = Path(__file__).parent
OURS = "Supple XPBD, 20 substeps"
OURS_WITH_CONTACT = "the same, with self-collision"


def main(rounds: int = 3, frames: int = 20) -> dict[str, Any]:
    """Print the table; returns its figures."""
    if not peers_installed():
        sys.exit("the other programs are not installed; run `make bench`, which installs them")
    beam = partial(run_json, sys.executable, HERE / "our_beam.py", threads=1)
    newton = partial(run_json, PEERS_PYTHON, HERE / "peers" / "newton_beam.py")
    mujoco = partial(run_json, PEERS_PYTHON, HERE / "peers" / "mujoco_beam.py")
    programs = {
        # The other programs do not detect collisions of the beam with itself, so Supple runs without and with it.
        OURS: partial(beam, "xpbd_without_contact", 2, 20, frames),
        OURS_WITH_CONTACT: partial(beam, "xpbd", 2, 20, frames),
        "Newton XPBD, 20 substeps x 1 iteration": partial(newton, "xpbd", 2, 20, 1, frames),
        "Newton VBD, 10 substeps x 10 iterations": partial(newton, "vbd", 2, 10, 10, 5),
        "MuJoCo flex, explicit, 1 ms": partial(mujoco, 2, 1e-3, "Euler", frames),
        "MuJoCo flex, discrete, 10 ms": partial(mujoco, 2, 1e-2, "discrete", frames),
        "MuJoCo flex, discrete, 1/60 s": partial(mujoco, 2, 1 / 60, "discrete", frames),
    }
    # Tet counts differ by mesh generator (5 or 6 tets a cell), so the first ratio compares time per tet.
    columns = {"program": "", "tets": ",d", "ms/frame": ".2f", "ratio per tet": ".1f", "ratio": ".1f", "finite": ""}
    table = Table(f"Hanging beam 1.2 x 0.4 x 0.4 m, the best of {rounds} rounds", columns, threads=1)
    best = alternate(programs, rounds)
    ours = best[OURS]
    for name, r in best.items():
        ratio = r["ms_per_frame"] / ours["ms_per_frame"]
        finite = "yes" if r["finite"] else "no"
        table.add(name, r["tets"], r["ms_per_frame"], ratio * ours["tets"] / r["tets"], ratio, finite)
    return table.figures()


def run() -> None:
    """Measure, and write the figures of docs/validation/benchmarks.md and README.md."""
    publish("hanging_beam", main())


if __name__ == "__main__":
    run()
