"""Processor times of starting up: `import supple`, and up to the first step of a simulation, first and second run.

usage: python -m benchmarks.startup
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from typing import Any

from benchmarks.publishing import publish
from benchmarks.table import Table

FIRST_STEP = """
import time, supple as sp
from supple.app.demos.registry import DEMOS
demo = DEMOS["squash"]
next(iter(sp.simulate(demo.scene(), demo.solver(), demo.dt, 1)))
"""


def seconds(code: str, environment: dict[str, str] | None = None) -> float:
    """Processor time of a fresh interpreter that runs `code`, its start included."""
    timed = code + "\nimport time; print(time.process_time())"
    done = subprocess.run([sys.executable, "-c", timed], check=True, env=environment, capture_output=True, text=True)
    return float(done.stdout.splitlines()[-1])


def main(rounds: int = 5) -> dict[str, Any]:
    """Print the table; returns its figures."""
    table = Table(f"Starting up, the best of {rounds} rounds", {"": "", "seconds of the processor": ".2f"})
    empty = min(seconds("pass") for _ in range(rounds))
    imported = min(seconds("import supple") for _ in range(rounds))
    table.add("`import supple`, beyond an empty interpreter", imported - empty)
    with tempfile.TemporaryDirectory() as cache:
        fresh = {**os.environ, "NUMBA_CACHE_DIR": cache}
        table.add("`squash` to its first step, nothing compiled yet, once", seconds(FIRST_STEP, fresh))
        table.add("the same, second run", min(seconds(FIRST_STEP, fresh) for _ in range(rounds)))
    return table.figures()


def run() -> None:
    """Measure, and write the figures of docs/validation/benchmarks.md."""
    publish("startup", main())


if __name__ == "__main__":
    run()
