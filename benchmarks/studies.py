"""Time of a study of 64 cases on two workers, as a part of that on one.

Run it:  python -m benchmarks.studies [--cases 64] [--steps 240] [--rounds 2]
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time

import supple as sp


def scene(youngs: float) -> sp.Scene:
    """A block of 1,080 tets that falls on a floor and comes to rest there."""
    material = sp.StableNeoHookean(youngs=youngs, poisson=0.4, density=1000)
    block = sp.Body("block", sp.shapes.box((0.3, 0.3, 0.3), (6, 6, 5)), material, position=(0, 0.2, 0))
    return sp.Scene([block], obstacles=[sp.HalfSpace(friction=0.5)])


def lowest(recording: sp.Recording) -> dict[str, float]:
    """Height of the lowest vertex in the last frame [m]."""
    return {"lowest": float(recording[-1].positions["block"][:, 1].min())}


def seconds(workers: int, cases: int, steps: int) -> float:
    """Wall-clock time of the whole study, workers' start and table included."""
    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        values = [1e5 * 10 ** (i / cases) for i in range(cases)]
        table = sp.sweep(
            scene, {"youngs": values}, measure=lowest, solver=sp.XPBD(), folder=folder, workers=workers, steps=steps
        )
        if any(table.reasons):
            raise RuntimeError(next(reason for reason in table.reasons if reason))
        return time.perf_counter() - began


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=64)
    parser.add_argument("--steps", type=int, default=240)
    parser.add_argument("--rounds", type=int, default=2)
    options = parser.parse_args()
    print(f"{options.cases} cases, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    for _ in range(options.rounds):
        one, two = (seconds(workers, options.cases, options.steps) for workers in (1, 2))
        print(f"one worker {one:.1f} s, two {two:.1f} s: {two / one:.3f}")


if __name__ == "__main__":
    main()
