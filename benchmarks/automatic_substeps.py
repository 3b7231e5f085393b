"""The error of XPBD's automatic number of substeps: sag and first frequency of a beam.

usage: python -m benchmarks.automatic_substeps [--quick]

A beam four times as long as it is thick, 8 x 2 x 3 cells, fixed at one end. Gravity is chosen for a sag of about 2 % of
its length, so that all sizes and stiffnesses have the same shape, which `Implicit` gives with its static integrator.
Cases that need more than 400 frames to come to rest are left out: their tets are so slow that the least number of
substeps is exact. What needs more than `max_substeps` is counted, and must be called `softened`.

The frequency is that of the undamped beam after gravity begins to act, over three and a half periods, where frames
resolve them; `Implicit` gives it with Newmark's method and 400 steps in a period.
"""

from __future__ import annotations

import logging
import math
import sys
from collections.abc import Iterable
from typing import Any

import numpy as np
from scipy.optimize import curve_fit

import supple as sp
from benchmarks.publishing import publish
from benchmarks.table import Table

# Wider than thick: of a square beam, both bending modes have nearly the same frequency, and beat.
CELLS, WIDTH, DENSITY = (8, 2, 3), 1.5, 1000.0
YOUNGS = (1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9)
POISSON = (0.0, 0.3, 0.45, 0.49)
SIZES = (1e-3, 1e-2, 0.1, 1.0, 10.0)
STEPS = (1 / 240, 1 / 60, 1 / 15)
MOST_FRAMES = 400
PERIODS = 3.5

Found = tuple[str, int, float]


def scene(youngs: float, poisson: float, size: float, tau: float = 0.0) -> sp.Scene:
    """The beam of this thickness [m], with damping tau [s]."""
    material = sp.StableNeoHookean(youngs=youngs, poisson=poisson, density=DENSITY, damping=tau)
    body = sp.Body("beam", sp.shapes.box((4 * size, size, WIDTH * size), CELLS), material)
    fixed = sp.Pin("beam", sp.InBox((-3 * size, -size, -size), (-1.999 * size, size, size)))
    return sp.Scene([body], pins=[fixed], gravity=(0, -2e-4 * youngs / (DENSITY * size), 0))


def sag(frame: sp.Frame, size: float) -> float:
    """How far the lowest vertex is below its place in the undeformed beam, in thicknesses."""
    return -float(frame.positions["beam"][:, 1].min()) / size - 0.5


def case(youngs: float, poisson: float, size: float, dt: float, reference: float) -> Found | None:
    """The status, the substeps and the error of the sag; None where the beam is too slow."""
    omega = 0.0634 * math.sqrt(youngs / DENSITY) / size
    frames = max(5, math.ceil(12.0 / (omega * dt)))
    if frames > MOST_FRAMES:
        return None
    run = sp.simulate(scene(youngs, poisson, size, 2.0 / omega), sp.XPBD(contact=None), dt, frames)
    *_, last = run
    return str(last.report.status), last.report.iterations, sag(last, size) / reference - 1.0


def period(frames: Iterable[sp.Frame], size: float, guess: float) -> float:
    """The period [s] of a damped cosine that is fitted to the sag over `PERIODS` periods of about `guess` [s]."""
    times, sags = np.transpose([(frame.time, sag(frame, size)) for frame in frames if frame.time <= PERIODS * guess])

    def cosine(t: np.ndarray, omega: float, decay: float, a: float, b: float, c: float) -> np.ndarray:
        return np.exp(-decay * t) * (a * np.cos(omega * t) + b * np.sin(omega * t)) + c

    level = float(sags.mean())
    found, _ = curve_fit(cosine, times, sags, p0=[2.0 * math.pi / guess, 0.0, -level, 0.0, level])
    return 2.0 * math.pi / abs(float(found[0]))


def frequency(youngs: float, poisson: float, size: float, dt: float, exact: float) -> Found | None:
    """The status, the substeps and the error of the frequency; None where frames do not resolve it, or it is too slow.

    exact : the period of a beam of E = 1e5 Pa and thickness 0.1 m [s]
    """
    expected = exact * size / 0.1 * math.sqrt(1e5 / youngs)
    count = math.ceil(PERIODS * expected / dt)
    if expected < 12.0 * dt or count > MOST_FRAMES:
        return None
    frames = list(sp.simulate(scene(youngs, poisson, size), sp.XPBD(contact=None), dt, count))
    report = frames[-1].report
    return str(report.status), report.iterations, expected / period(frames, size, expected) - 1.0


def row(found: list[Found | None]) -> list[Any]:
    """Errors of the cases that converged, substeps, softened cases and those that were left out."""
    run = [item for item in found if item is not None]
    good = np.array([abs(error) for status, _, error in run if status == "converged"])
    soft = np.array([abs(error) for status, _, error in run if status == "softened"])
    counts = [count for status, count, _ in run if status == "converged"]
    errors = [float(np.median(good)), float(good.max()), f"{min(counts)} to {max(counts)}"] if len(good) else [None] * 3
    others = sum(status not in ("converged", "softened") for status, _, _ in run)
    softened = [len(soft), float(np.median(soft)) if len(soft) else None]
    return [f"{len(good)} of {len(run)}", *errors, *softened, others, len(found) - len(run)]


def main(quick: bool = False) -> dict[str, Any]:
    """Print a table of sags and one of frequencies; returns the figures of the first."""
    logging.disable(logging.WARNING)
    columns = {"nu": "g", "converged": "", "median error": ".2%", "largest": ".2%", "substeps": ""}
    columns |= {"softened": "d", "median error of these": ".0%", "other statuses": "d", "left out": "d"}
    table, tones = Table("Sag at XPBD's automatic number of substeps", columns), []
    for poisson in POISSON:
        *_, still = sp.simulate(scene(1e5, poisson, 0.1), sp.Implicit(integrator="static", contact=None), 1 / 60, 2)
        reference = sag(still, 0.1)
        guess = 2.0 * math.pi / (0.0634 * math.sqrt(1e5 / DENSITY) / 0.1)
        newmark = sp.Implicit(integrator="newmark", contact=None)
        frames = list(sp.simulate(scene(1e5, poisson, 0.1), newmark, guess / 400, 1600))
        exact = period(frames, 0.1, period(frames, 0.1, guess))
        cases = [
            (youngs, size, dt)
            for youngs in YOUNGS[:: 3 if quick else 1]
            for size in SIZES[:: 2 if quick else 1]
            for dt in STEPS[:: 2 if quick else 1]
        ]
        sags = [case(youngs, poisson, size, dt, reference) for youngs, size, dt in cases]
        table.add(poisson, *row(sags))
        tones.append((poisson, [frequency(youngs, poisson, size, dt, exact) for youngs, size, dt in cases]))
    second = Table("Frequency", columns)
    for poisson, errors in tones:
        second.add(poisson, *row(errors))
    return table.figures()


def run() -> None:
    """Measure, and write the figures of docs/validation/benchmarks.md."""
    publish("automatic_substeps", main())


if __name__ == "__main__":
    if "--quick" in sys.argv[1:]:
        main(quick=True)
    else:
        run()
