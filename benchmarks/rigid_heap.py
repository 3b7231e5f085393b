"""Rigid boxes of twelve triangles that fall into a heap, in XPBD.

usage: python -m benchmarks.rigid_heap

CPU time of the frames, of all threads, in three parts of the run: while boxes fall, while they pile up, and later.
"""

from __future__ import annotations

import time
from itertools import pairwise
from typing import Any

import numpy as np

import supple as sp
from benchmarks.table import Table
from supple.solvers.xpbd.details import XPBDDetails

SIZE, PER_SIDE, GAP = 0.1, 5, 1.8


def scene(count: int) -> sp.Scene:
    """Boxes, turned at random, in layers of 5 x 5 above a floor."""
    rng = np.random.default_rng(0)
    box = sp.shapes.box_surface((SIZE, SIZE, SIZE), (1, 1, 1))
    bodies = []
    for i in range(count):
        layer, place = divmod(i, PER_SIDE**2)
        a, b = divmod(place, PER_SIDE)
        axis = rng.normal(size=3)
        turn = rng.uniform(0.0, np.pi) / np.linalg.norm(axis) * axis
        position = SIZE * GAP * np.array([a - 2, layer + 0.9, b - 2])
        bodies.append(sp.RigidBody(f"{i}", box, density=500.0, position=position, rotation=turn, friction=0.5))
    return sp.Scene(bodies, obstacles=[sp.HalfSpace(friction=0.5)])


def main(count: int = 200, steps: int = 90, dt: float = 1 / 60) -> dict[str, Any]:
    """Print the table; returns its figures."""
    table = Table(f"{count} rigid boxes, frames of {1e3 * dt:.1f} ms", {"frames": "", "ms/frame, mean": ".1f"})
    times, substeps, statuses = [time.process_time()], [], []
    for frame in sp.simulate(scene(count), sp.XPBD(), dt, steps):
        times.append(time.process_time())
        if isinstance(frame.report.details, XPBDDetails):
            substeps.append(frame.report.details.substeps)
        statuses.append(frame.report.status)
    # The first two have compiled what was not cached.
    spent = [after - before for before, after in pairwise(times[3:])]
    for name, part in zip(("first third", "second third", "last third"), np.array_split(spent, 3), strict=True):
        table.add(name, 1e3 * float(np.mean(part)))
    states = ", ".join(sorted({str(status) for status in statuses}))
    table.note(
        f"{count} boxes, {steps} frames: {np.mean(substeps[1:]):.1f} substeps a frame; the longest took "
        f"{1e3 * max(spent):.0f} ms; statuses: {states}."
    )
    return table.figures()


def run() -> None:
    """Measure, and print the table."""
    main()


if __name__ == "__main__":
    run()
