"""Cost of a step with contact, and of its parts: the torture scenes, and some of them with about 20,000 tets.

usage: python -m benchmarks.contact_scenes [SCENE ...] [--quick]

SCENE is a name such as `stack`, or `stack:small`, `stack:full`, `stack:large`; without any, all full and large ones are
run. A scene is run for at most 100 steps. Means are over the steps that have contacts, without the first of them, which
loads compiled kernels.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence

import supple as sp
from supple.demos.demo import Demo
from supple.demos.torture.registry import TORTURE
from supple.implicit.details import ImplicitDetails

MAX_STEPS = 100
PARTS = ("contact", "elasticity", "linear_solve")


def measured(demo: Demo) -> dict[str, float]:
    """Run a demo: tets, most contacts in a frame, and means over the steps with contacts."""
    tets = most = touching = iterations = 0
    seconds, parts = 0.0, dict.fromkeys(PARTS, 0.0)
    converged, loaded = True, False
    for frame in sp.simulate(demo.scene(), demo.solver(), demo.dt, min(demo.steps, MAX_STEPS)):
        report, details = frame.report, frame.report.details
        assert isinstance(details, ImplicitDetails)
        tets = len(frame.system.tets)
        converged &= report.status == "converged"
        count = details.contacts
        if count == 0 or not loaded:
            loaded = count > 0
            continue
        most, touching = max(most, count), touching + 1
        iterations += report.iterations
        seconds += report.wall_seconds
        for name in PARTS:
            parts[name] += details.seconds[name]
    steps = max(touching, 1)
    return {
        "tets": tets,
        "contacts": most,
        "iterations": iterations / steps,
        "seconds": seconds / steps,
        **{name: value / max(seconds, 1e-300) for name, value in parts.items()},
        "converged": converged,
    }


def main(names: Sequence[str] = (), quick: bool = False) -> None:
    chosen: list[str] = list(names)
    if not chosen:
        sizes = ("small",) if quick else ("full", "large")
        chosen = [f"{name}:{size}" for size in sizes for name, scene in TORTURE.items() if getattr(scene, size)]
    load = f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"
    print(f"\nSteps with contact; load of the machine at the start: {load}")
    print(f"{'scene':<16}{'tets':>7}{'contacts':>10}{'Newton':>8}{'s/step':>9}{'contact':>9}{'elastic':>9}{'solve':>7}")
    for item in chosen:
        name, _, size = item.partition(":")
        demo = getattr(TORTURE.get(name), size or "full", None)
        if demo is None:
            raise SystemExit(
                f"there is no scene {item!r}; there are {', '.join(TORTURE)}, with :small, :full, some :large"
            )
        result = measured(demo)
        print(
            f"{item:<16}{result['tets']:7.0f}{result['contacts']:10.0f}{result['iterations']:8.1f}{result['seconds']:9.3f}"
            f"{result['contact']:9.0%}{result['elasticity']:9.0%}{result['linear_solve']:7.0%}"
            f"{'' if result['converged'] else '  not every step converged'}",
            flush=True,
        )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE")
    parser.add_argument("--quick", action="store_true", help="the small scenes")
    given = parser.parse_args()
    main(given.scenes, given.quick)
