"""Where the time to compile goes, up to the first frame: kernels, inner functions and passes of Numba, cache empty.

usage: python -m benchmarks.compilation [snippet|implicit|bears|squash] [--all]
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections import Counter
from typing import Any

from numba.core import event

import supple as sp

# The rows that are printed without `--all`.
ROWS = 45


def first_frame(name: str) -> None:
    """Simulate one frame of the README's snippet, with a solver, or of a demo."""
    if name in ("snippet", "implicit"):
        mesh = sp.shapes.sphere(radius=0.5, edge_length=0.2)
        material = sp.StableNeoHookean(youngs=5e4, poisson=0.45, density=1000)
        ball = sp.Body("ball", mesh, material, position=(0, 1, 0))
        floor = sp.HalfSpace(point=(0, 0, 0), normal=(0, 1, 0), friction=0.5)
        scene, dt = sp.Scene(bodies=[ball], obstacles=[floor]), 1 / 60
        solver: Any = sp.XPBD(substeps=20) if name == "snippet" else sp.Implicit()
    else:
        from supple.app.demos.registry import DEMOS

        demo = DEMOS[name]
        scene, solver, dt = demo.scene(), demo.solver(), demo.dt
    next(iter(sp.simulate(scene, solver, dt, 1)))


class Clock(event.Listener):
    """Seconds of every compilation, or of every pass, without those within it (`own`) and with them (`whole`)."""

    def __init__(self) -> None:
        self.open: list[list[Any]] = []
        self.own: Counter[str] = Counter()
        self.whole: Counter[str] = Counter()
        self.count: Counter[str] = Counter()
        self.signatures: dict[str, list[str]] = {}  # of kernels

    def on_start(self, event):
        """Begin to count."""
        self.open.append([time.process_time(), 0.0])

    def on_end(self, event):
        """Count the time, and take it from that around it."""
        started, inner = self.open.pop()
        seconds = time.process_time() - started
        if self.open:
            self.open[-1][1] += seconds
        name = event.data.get("name")
        if name is None:
            function = event.data["dispatcher"].py_func
            name = f"{function.__module__.removeprefix('supple.')}:{function.__name__}"
            if not self.open:
                self.signatures.setdefault(name, []).append(str(event.data["args"]))
        self.own[name] += seconds - inner
        self.whole[name] += seconds
        self.count[name] += 1


def report(name: str, rows: int | None) -> None:
    """Compile what the first frame of a scene needs, and print where the time went."""
    compilations, passes = Clock(), Clock()
    event.register("numba:compile", compilations)
    event.register("numba:run_pass", passes)
    first_frame(name)
    seconds = time.process_time()
    kernels = sum(len(item) for item in compilations.signatures.values())
    total = sum(compilations.count.values())
    print(f"{name}: {seconds:.1f} s of the processor; {total} compilations, {kernels} of them kernels", flush=True)
    print("\n   own  with what it calls  times")
    for key, own in compilations.own.most_common(rows):
        print(f"{own:6.2f} {compilations.whole[key]:8.2f} {compilations.count[key]:6}  {key}")
    print("\nKernels called from Python, all that they compile included")
    whole = Counter({key: compilations.whole[key] for key in compilations.signatures})
    for key, seconds in whole.most_common(rows):
        print(f"{seconds:6.2f} {len(compilations.signatures[key]):3}  {key}")
        if rows is None and len(compilations.signatures[key]) > 1:
            print("\n".join(f"           {item}" for item in compilations.signatures[key]))
    print("\nPasses")
    for key, seconds in passes.own.most_common(12):
        print(f"{seconds:6.2f}  {key}")


def main() -> None:
    """Run in a fresh interpreter with an empty cache."""
    names = [item for item in sys.argv[1:] if not item.startswith("--")] or ["snippet", "implicit", "bears"]
    if "--here" in sys.argv:
        report(names[0], None if "--all" in sys.argv else ROWS)
        return
    for name in names:
        with tempfile.TemporaryDirectory() as cache:
            command = [sys.executable, "-m", "benchmarks.compilation", name, "--here"]
            command += ["--all"] if "--all" in sys.argv else []
            subprocess.run(command, check=True, env={**os.environ, "NUMBA_CACHE_DIR": cache})


if __name__ == "__main__":
    main()
