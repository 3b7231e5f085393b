"""The time of a step of a finger with cavity and cable in XPBD, and of reading all fields of its frame.

usage: python -m benchmarks.reading_fields

Processor time on one thread, and the frames a second of wall time with two threads: the medians over some frames, after
the first ones, in which the finger begins to move.
"""

from __future__ import annotations

import statistics
import time
from itertools import pairwise
from typing import Any

from numba import config
from numba.np.ufunc.parallel import threading_layer

import supple as sp
from benchmarks.table import circumstances
from supple.app.demos.pneunet import bellows
from supple.results.readings.fields import FIELDS
from supple.solvers.xpbd.details import XPBDDetails

CELL = 0.01
SOFT, STIFFER = 2e4, 1e5  # Young's moduli of the finger [Pa]


def scene(chambers: int = 3, youngs: float = SOFT) -> sp.Scene:
    """A bellows finger of tets of 5 mm, 12,096 of them with three chambers, with air and a cable with friction.

    Pressure and tension are in proportion to Young's modulus, so that it bends likewise.
    """
    share = youngs / SOFT
    mesh = bellows(chambers, CELL, (2, 2, 2))
    rubber = sp.StableNeoHookean(youngs=youngs, poisson=0.4, damping=0.02)
    end, middle = mesh.vertices[:, 0].max(), 0.5 * mesh.vertices[:, 2].max()
    places = [("finger", (x, 0.1 * CELL, middle)) for x in (end - 1e-4, 0.5 * end, 1e-4)]
    return sp.Scene(
        [sp.Body("finger", mesh, rubber)],
        pins=[sp.Pin("finger", sp.InBox((-1, -1, -1), (1e-6, 1, 1)))],
        cavities=[sp.Cavity("finger", pressure=sp.Curve([0.0, 0.5], [0.0, 1e3 * share]))],
        cables=[sp.Cable(places, tension=sp.Curve([0.0, 0.5], [0.0, 0.1 * share]), friction=0.1)],
    )


def measured(given: sp.Scene, frames: int, skipped: int) -> dict[str, Any]:
    """Medians of a step and of reading each field, in the order of `FIELDS`, which share what they need [ms]."""
    steps: list[float] = []
    parts: dict[str, list[float]] = {name: [] for name in FIELDS}
    substeps = []
    item = sp.simulate(given, sp.XPBD(threads=1), 1 / 60, skipped + frames)
    for _ in range(skipped + frames):
        began = time.process_time()
        frame = next(item)
        steps.append(time.process_time() - began)
        if frame.report.status != "converged":
            raise RuntimeError(frame.report.message)
        for name, field in FIELDS.items():
            began = time.process_time()
            field.values(frame)
            parts[name].append(time.process_time() - began)
        assert isinstance(frame.report.details, XPBDDetails)
        substeps.append(frame.report.details.substeps)
    reading = [sum(values) for values in zip(*parts.values(), strict=True)]
    middle = {name: 1e3 * statistics.median(values[skipped:]) for name, values in parts.items()}
    return {
        "substeps": statistics.median(substeps[skipped:]),
        "ms_per_step": 1e3 * statistics.median(steps[skipped:]),
        "ms_of_reading": 1e3 * statistics.median(reading[skipped:]),
        "fields": middle,
    }


def live_rates(chambers: int, threads: int, frames: int, skipped: int) -> list[dict[str, float]]:
    """Frames a second of wall time, in the median, without reading any field, and the substeps of the last frame."""
    rates = []
    for youngs in (SOFT, STIFFER):
        times, substeps = [], 0
        for frame in sp.simulate(scene(chambers, youngs), sp.XPBD(threads=threads), 1 / 60, skipped + frames):
            times.append(time.perf_counter())
            if isinstance(frame.report.details, XPBDDetails):
                substeps = frame.report.details.substeps
        spent = statistics.median(after - before for before, after in pairwise(times[skipped:]))
        rates.append({"youngs": youngs, "frames_a_second": 1.0 / spent, "substeps": substeps})
    return rates


def main(chambers: int = 3, frames: int = 40, skipped: int = 20) -> dict[str, Any]:
    """Print the table; returns its figures."""
    at_start, given = circumstances(), scene(chambers)
    figures = measured(given, frames, skipped)
    threads = min(2, int(config.NUMBA_NUM_THREADS))  # pyright: ignore[reportAttributeAccessIssue]
    rates = live_rates(chambers, threads, frames, skipped)
    live = {"threads_live": threads, "layer": threading_layer() if threads > 1 else "", "live": rates}
    tets = len(given.bodies[0].mesh.tets)
    share = figures["ms_of_reading"] / figures["ms_per_step"]
    print(f"\na finger of {tets} tets, {figures['substeps']:.0f} substeps, processor time on one thread")
    print(f"{'a step':32}{figures['ms_per_step']:9.2f} ms")
    for name, milliseconds in figures["fields"].items():
        print(f"{name:32}{milliseconds:9.2f} ms")
    print(f"{'all fields':32}{figures['ms_of_reading']:9.2f} ms, {100 * share:.1f} % of a step")
    for item in rates:
        name = f"{threads} threads, {item['youngs']:g} Pa"
        print(f"{name:32}{item['frames_a_second']:9.1f} frames/s, {item['substeps']} substeps")
    return {**at_start, "tets": tets, "share": share, **figures, **live}


def run() -> None:
    """Measure, and print the table."""
    main()


if __name__ == "__main__":
    run()
