"""Environment steps per second of a batch: bodies of a thousand tets on a floor, XPBD with 20 substeps.

Run it:  python -m benchmarks.batch [--copies 64] [--steps 5] [--repetitions 5]
"""

from __future__ import annotations

import argparse
import os
import time

import supple as sp

SELF_CONTACT = {"off": None, "on": sp.XPBDContact()}
MATERIALS = {
    "StableNeoHookean": sp.StableNeoHookean(youngs=1e5, poisson=0.4, density=1000),
    "EdgesAndVolume": sp.EdgesAndVolume(edge_compliance=1e-5, volume_compliance=0.0, density=1000),
}


def scene(material: sp.StableNeoHookean | sp.EdgesAndVolume) -> sp.Scene:
    """A block of 1,080 tets that lies on a floor."""
    block = sp.Body("block", sp.shapes.box((0.3, 0.3, 0.3), (6, 6, 5)), material, position=(0, 0.15, 0))
    return sp.Scene([block], obstacles=[sp.HalfSpace(friction=0.5)])


def steps_per_second(batch: sp.Batch, steps: int, repetitions: int) -> float:
    """Best of some repetitions from the same moment; many short ones find a moment when the machine is idle."""
    there, best = batch.snapshot(), float("inf")
    for _ in range(repetitions):
        batch.restore(there)
        began = time.perf_counter()
        for _ in range(steps):
            batch.step()
        best = min(best, time.perf_counter() - began)
    return steps * len(batch) / best


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--copies", type=int, default=64)
    parser.add_argument("--steps", type=int, default=5)
    parser.add_argument("--repetitions", type=int, default=5)
    options = parser.parse_args()
    print(f"{options.copies} copies, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    for contact, settings in SELF_CONTACT.items():
        for name, material in MATERIALS.items():
            rates = []
            for threads in (1, 2):
                with sp.Batch(
                    scene(material), options.copies, sp.XPBD(substeps=20, contact=settings), threads=threads
                ) as batch:
                    batch.step()
                    rates.append(steps_per_second(batch, options.steps, options.repetitions))
            one, two = rates
            print(f"{name}, self-contact {contact}: {one:.0f}/s on one thread, {two:.0f}/s on two: {two / one:.2f}")


if __name__ == "__main__":
    main()
