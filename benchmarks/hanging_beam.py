"""The hanging beam in Supple, Newton and MuJoCo flex, alternately in one run: ms per frame of 1/60 s, and ratios.

usage: python -m benchmarks.hanging_beam [--busy]
"""

from __future__ import annotations

import argparse
import sys
from functools import partial
from pathlib import Path

from benchmarks.measuring import PEERS_PYTHON, alternate, busy_core, peers_installed, run_json

HERE = Path(__file__).parent
OURS = "Supple XPBD, 20 substeps"
OURS_WITH_CONTACT = "Supple XPBD, 20 substeps, self-collision"


def main(busy: bool = False, rounds: int = 3, frames: int = 20) -> None:
    if not peers_installed():
        sys.exit("the other programs are not installed; run `make bench`, which installs them")
    ours = partial(run_json, sys.executable, HERE / "our_beam.py")
    newton = partial(run_json, PEERS_PYTHON, HERE / "peers" / "newton_beam.py")
    mujoco = partial(run_json, PEERS_PYTHON, HERE / "peers" / "mujoco_beam.py")
    programs = {
        # The other programs do not detect collisions of the beam with itself, so Supple runs without and with it.
        OURS: partial(ours, "xpbd_without_contact", 2, 20, frames),
        OURS_WITH_CONTACT: partial(ours, "xpbd", 2, 20, frames),
        "Newton XPBD, 20 substeps x 1 iteration": partial(newton, "xpbd", 2, 20, 1, frames),
        "Newton VBD, 10 substeps x 10 iterations": partial(newton, "vbd", 2, 10, 10, 5),
        "MuJoCo flex, explicit, 1 ms": partial(mujoco, 2, 1e-3, "Euler", frames),
        "MuJoCo flex, discrete, 10 ms": partial(mujoco, 2, 1e-2, "discrete", frames),
        "MuJoCo flex, discrete, 1/60 s": partial(mujoco, 2, 1 / 60, "discrete", frames),
    }
    with busy_core(busy):
        best = alternate(programs, rounds)
    # Tet counts differ by mesh generator (5 or 6 tets a cell), so the ratio compares time per tet.
    our_cost = best[OURS]["ms_per_frame"] / best[OURS]["tets"]
    print(f"\nHanging beam 1.2 x 0.4 x 0.4 m, {'one core busy' if busy else 'idle machine'}, best of {rounds} rounds")
    print(f"{'solver':44}{'tets':>8}{'ms/frame':>11}{'us/tet':>9}{'ratio/tet':>11}{'ratio':>8}  {'finite':6}")
    for name, r in best.items():
        cost = r["ms_per_frame"] / r["tets"]
        print(
            f"{name:44}{r['tets']:8d}{r['ms_per_frame']:11.2f}{1e3 * cost:9.3f}{cost / our_cost:11.1f}"
            f"{r['ms_per_frame'] / best[OURS]['ms_per_frame']:8.1f}  {r['finite']!s:6}"
        )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--busy", action="store_true", help="keep one core busy with another process")
    main(busy=parser.parse_args().busy)
