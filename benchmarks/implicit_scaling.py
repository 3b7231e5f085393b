"""Cost of a converged implicit step from 9,216 to 395,136 tets: time, memory, and the exponent of growth.

usage: python -m benchmarks.implicit_scaling [--quick] [--threads N]

The hanging beam of `our_beam.py` in backward Euler steps of 1/60 s, each size in a separate process.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

from benchmarks.measuring import run_json

HERE = Path(__file__).parent
SCALES = (2, 3, 4, 5, 7)
FRAMES = 5


def main(quick: bool = False, threads: int | None = None) -> None:
    print(f"\nImplicit step of 1/60 s of the hanging beam, mean of {FRAMES}")
    print(f"{'tets':>9}{'ms/step':>10}{'Newton/step':>13}{'us/tet':>9}{'MB':>8}  statuses")
    sizes, times = [], []
    for scale in SCALES[: 3 if quick else None]:
        result = run_json(
            sys.executable,
            HERE / "our_beam.py",
            *("implicit", scale, 1 / 60, "backward_euler", 0, FRAMES),
            threads=threads,
        )
        sizes.append(result["tets"])
        times.append(result["ms_per_step"])
        peak = "?" if result["peak_MB"] is None else f"{result['peak_MB']:.0f}"
        print(
            f"{sizes[-1]:9d}{times[-1]:10.1f}{result['iterations_per_step']:13.1f}{1e3 * times[-1] / sizes[-1]:9.2f}"
            f"{peak:>8}  {', '.join(result['statuses'])}",
            flush=True,
        )
    exponent = np.polyfit(np.log(sizes), np.log(times), 1)[0]
    print(f"the time of a step grows with the tets to the power {exponent:.2f} (target: at most 1.2)")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="the three smallest sizes")
    parser.add_argument("--threads", type=int, default=None, help="of Supple; all without it")
    chosen = parser.parse_args()
    main(chosen.quick, chosen.threads)
