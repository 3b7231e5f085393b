"""Cost of a converged implicit step from 9,216 to 395,136 tets: processor time, memory, exponent of growth.

usage: python -m benchmarks.implicit_scaling [--quick]

The hanging beam of `our_beam.py` in backward Euler steps of 1/60 s, each size in a separate process.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.measuring import run_json
from benchmarks.publishing import publish
from benchmarks.table import Table

HERE = Path(__file__).parent
SCALES = (2, 3, 4, 5, 7)
FRAMES = 5


def main(quick: bool = False) -> dict[str, Any]:
    """Print the table; returns its figures."""
    columns = {"tets": ",d", "ms/step": ".1f", "Newton/step": ".1f", "us/tet": ".2f", "MB": ".0f", "statuses": ""}
    table = Table(f"Implicit step of 1/60 s of the hanging beam, mean of {FRAMES}", columns, threads=1)
    for scale in SCALES[: 3 if quick else None]:
        arguments = ("implicit", scale, 1 / 60, "backward_euler", 0, FRAMES)
        found = run_json(sys.executable, HERE / "our_beam.py", *arguments, threads=1)
        tets, ms = found["tets"], found["ms_per_step"]
        table.add(
            tets, ms, found["iterations_per_step"], 1e3 * ms / tets, found["peak_MB"], ", ".join(found["statuses"])
        )
    sizes, times = np.log([row[:2] for row in table.rows]).T
    exponent = np.polyfit(sizes, times, 1)[0]
    table.note(f"The time of a step grows with the tets to the power {exponent:.2f} (target: at most 1.2).")
    return table.figures()


def run() -> None:
    """Measure, and write the figures of docs/validation/benchmarks.md."""
    publish("implicit_scaling", main())


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="the three smallest sizes; nothing is written")
    if parser.parse_args().quick:
        main(quick=True)
    else:
        run()
