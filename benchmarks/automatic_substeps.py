"""The error of XPBD's automatic number of substeps: the static sag of a beam over stiffness, size, nu and frame length.

usage: python -m benchmarks.automatic_substeps [--quick]

A beam four times as long as it is thick, 8 x 2 x 2 cells, fixed at one end. Gravity is chosen for a sag of about 2 % of
its length, so that all sizes and stiffnesses have the same shape, which `Implicit` gives with its static integrator.
Cases that need more than 400 frames to come to rest are left out: their tets are so slow that the least number of
substeps is exact. What needs more than `max_substeps` is counted, and must be called `softened`.
"""

from __future__ import annotations

import logging
import math
import sys

import numpy as np

import supple as sp

CELLS, DENSITY = (8, 2, 2), 1000.0
YOUNGS = (1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9)
POISSON = (0.0, 0.3, 0.45, 0.49)
SIZES = (1e-3, 1e-2, 0.1, 1.0, 10.0)
STEPS = (1 / 240, 1 / 60, 1 / 15)
MOST_FRAMES = 400


def scene(youngs: float, poisson: float, size: float, tau: float = 0.0) -> sp.Scene:
    """The beam of this thickness [m], with damping tau [s]."""
    material = sp.StableNeoHookean(youngs=youngs, poisson=poisson, density=DENSITY, damping=tau)
    body = sp.Body("beam", sp.shapes.box((4 * size, size, size), CELLS), material)
    fixed = sp.Pin("beam", sp.InBox((-3 * size, -size, -size), (-1.999 * size, size, size)))
    return sp.Scene([body], pins=[fixed], gravity=(0, -2e-4 * youngs / (DENSITY * size), 0))


def sag(frame: sp.Frame, size: float) -> float:
    """How far the lowest vertex is below its place in the undeformed beam, in thicknesses."""
    return -float(frame.positions["beam"][:, 1].min()) / size - 0.5


def case(youngs: float, poisson: float, size: float, dt: float, reference: float) -> tuple[str, int, float] | None:
    """The status, the substeps and the error of the sag; None where the beam is too slow."""
    omega = 0.0634 * math.sqrt(youngs / DENSITY) / size
    frames = max(5, math.ceil(12.0 / (omega * dt)))
    if frames > MOST_FRAMES:
        return None
    run = sp.simulate(scene(youngs, poisson, size, 2.0 / omega), sp.XPBD(contact=None), dt, frames)
    *_, last = run
    return str(last.report.status), last.report.iterations, sag(last, size) / reference - 1.0


def main(quick: bool = False) -> None:
    """Print a row for each nu."""
    logging.disable(logging.WARNING)
    print("nu | cases | errors of converged ones: median, largest | substeps | softened, median error | too slow")
    for poisson in POISSON:
        *_, still = sp.simulate(scene(1e5, poisson, 0.1), sp.Implicit(integrator="static", contact=None), 1 / 60, 2)
        reference = sag(still, 0.1)
        found, slow = [], 0
        for youngs in YOUNGS[:: 3 if quick else 1]:
            for size in SIZES[:: 2 if quick else 1]:
                for dt in STEPS[:: 2 if quick else 1]:
                    each = case(youngs, poisson, size, dt, reference)
                    slow += each is None
                    found += [] if each is None else [each]
        good = np.array([abs(error) for status, _, error in found if status == "converged"])
        soft = np.array([abs(error) for status, _, error in found if status == "softened"])
        counts = [count for status, count, _ in found if status == "converged"]
        others = sorted({status for status, _, _ in found} - {"converged", "softened"})
        print(
            f"{poisson:g} | {len(found)} | {np.median(good):.2%}, {good.max():.2%} | {min(counts)} to {max(counts)} | "
            f"{len(soft)}, {np.median(soft):.0%} | {slow}",
            *others,
            flush=True,
        )


if __name__ == "__main__":
    main("--quick" in sys.argv[1:])
