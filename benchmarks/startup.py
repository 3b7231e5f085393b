"""Start-up times: `import supple`, and the time to the first step of a simulation, first and second run.

usage: python -m benchmarks.startup
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time

FIRST_STEP = """
import time, supple as sp
from supple.demos.registry import DEMOS
demo = DEMOS["squash"]
next(iter(sp.simulate(demo.scene(), demo.solver(), demo.dt, 1)))
"""


def seconds(code: str, environment: dict[str, str] | None = None) -> float:
    """Wall time of a fresh interpreter that runs `code`."""
    start = time.perf_counter()
    subprocess.run([sys.executable, "-c", code], check=True, env=environment)
    return time.perf_counter() - start


def main(rounds: int = 5) -> None:
    empty = min(seconds("pass") for _ in range(rounds))
    imported = min(seconds("import supple") for _ in range(rounds))
    print(f"\nimport supple: {imported - empty:.3f} s beyond an empty interpreter ({empty:.3f} s), best of {rounds}")
    with tempfile.TemporaryDirectory() as cache:
        fresh = {**os.environ, "NUMBA_CACHE_DIR": cache}
        print(f"squash to its first step, nothing compiled yet: {seconds(FIRST_STEP, fresh):.1f} s")
        print(f"squash to its first step, second run: {min(seconds(FIRST_STEP, fresh) for _ in range(rounds)):.2f} s")


if __name__ == "__main__":
    main()
