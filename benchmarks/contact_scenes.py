"""Cost of a step with contact, and of its parts: the torture scenes, some of them with about 20,000 tets, and cubes.

usage: python -m benchmarks.contact_scenes [SCENE ...] [--quick] [--steps N] [--against PATH]

SCENE is a name such as `stack`, or `stack:small`, `stack:full`, `stack:large`, or `tumbling`, 27 cubes that fall on
each other, or `pull`, a ball between two spheres; without any, all full and large ones and those two are run. Means are
over the steps that have contacts, without the first of them, which loads compiled kernels; times are of the processor,
shares of the wall time.

With --against, every scene also runs on the package of another checkout, whose folder `src` is PATH. The two run one
after the other in processes of their own, and ratios are given: other / this.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from tests.torture.registry import TORTURE

import supple as sp
from benchmarks.table import Table
from supple.solvers.implicit.details import ImplicitDetails

ROOT = Path(__file__).resolve().parents[1]
MAX_STEPS = 100
PARTS = ("contact", "elasticity", "linear_solve")
SIDES = ("left", -0.13), ("right", 0.13)


class Case(NamedTuple):
    """A scene, its solver, the length of a step [s] and their number."""

    scene: sp.Scene
    solver: sp.Implicit
    dt: float
    steps: int


def tumbling() -> Case:
    """27 cubes of 10 cm (48 tets each), mu = .4, in three layers that fall on each other and on a floor."""
    rng = np.random.default_rng(3)
    cube = sp.shapes.box((0.1, 0.1, 0.1), (2, 2, 2))
    rubber = sp.StableNeoHookean(youngs=1e5, poisson=0.4, density=1000.0)
    bodies = []
    for k in range(27):
        i, j, layer = k % 3, (k // 3) % 3, k // 9
        shift, velocity = 0.01 * rng.normal(size=2), 0.5 * rng.normal(size=3)
        place = (0.19 * (i - 1) + shift[0], 0.12 + 0.19 * layer, 0.19 * (j - 1) + shift[1])
        bodies.append(sp.Body(f"cube {k}", cube, rubber, position=place, velocity=tuple(velocity), friction=0.4))
    return Case(sp.Scene(bodies, [sp.HalfSpace(friction=0.4)]), sp.Implicit(), 1 / 60, 60)


def pull() -> Case:
    """A ball of 10 cm, E = 50 kPa, that a pin pulls through a gap of 6 cm between two spheres of 20 cm, mu = .9."""
    mesh = sp.shapes.sphere(0.05, 0.014)
    ball = sp.StableNeoHookean(youngs=5e4, poisson=0.4, density=1000.0)
    spheres = [sp.obstacles.Sphere(name=name, center=(x, 0, 0), radius=0.1, friction=0.9) for name, x in SIDES]
    grip = np.flatnonzero(np.linalg.norm(mesh.vertices - (0, -0.05, 0), axis=1) < 0.025)
    way = sp.Keyframes([0.0, 1.0], displacements=[(0, 0, 0), (0, -0.25, 0)])
    height = 0.001 + float(np.sqrt(0.15**2 - 0.13**2))
    body = sp.Body("ball", mesh, ball, position=(0, height, 0))
    return Case(sp.Scene([body], spheres, pins=[sp.Pin("ball", grip, way)]), sp.Implicit(), 1 / 40, 40)


SCENES = {"tumbling": tumbling, "pull": pull}


def case(item: str) -> Case:
    """The scene of a name such as `stack:small`."""
    if item in SCENES:
        return SCENES[item]()
    name, _, size = item.partition(":")
    demo = getattr(TORTURE.get(name), size or "full", None)
    if demo is None:
        raise SystemExit(
            f"there is no scene {item!r}; there are {', '.join([*SCENES, *TORTURE])}, with :small, :full, some :large"
        )
    return Case(demo.scene(), demo.solver(), demo.dt, demo.steps)


def measured(run: Case, most_steps: int = MAX_STEPS) -> dict[str, float]:
    """Run a case: tets, most contacts in a frame, the smallest distance, and means over the steps with contacts."""
    tets = most = touching = iterations = 0
    seconds, wall, parts, nearest = 0.0, 0.0, dict.fromkeys(PARTS, 0.0), float("inf")
    began = time.process_time()
    converged, loaded = True, False
    for frame in sp.simulate(run.scene, run.solver, run.dt, min(run.steps, most_steps)):
        now = time.process_time()
        spent, began = now - began, now
        report, details = frame.report, frame.report.details
        assert isinstance(details, ImplicitDetails)
        tets = len(frame.system.tets)
        converged &= report.status == "converged"
        nearest = min(nearest, report.min_distance or float("inf"))
        count = details.contacts
        if count == 0 or not loaded:
            loaded = count > 0
            continue
        most, touching = max(most, count), touching + 1
        iterations += report.iterations
        seconds += spent
        wall += report.wall_seconds
        for name in PARTS:
            parts[name] += details.seconds[name]
    steps = max(touching, 1)
    return {
        "tets": tets,
        "contacts": most,
        "iterations": iterations / steps,
        "seconds": seconds / steps,
        **{name: value / max(wall, 1e-300) for name, value in parts.items()},
        "nearest": nearest,
        "converged": converged,
    }


def in_process(item: str, package: Path, steps: int) -> dict[str, float]:
    """`measured` in a new process that imports supple from the folder `package`."""
    code = (
        "import json, sys; from benchmarks.contact_scenes import case, measured; "
        "print(json.dumps(measured(case(sys.argv[1]), int(sys.argv[2]))))"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(package), str(ROOT)])}
    arguments = [sys.executable, "-c", code, item, str(steps)]
    done = subprocess.run(arguments, capture_output=True, text=True, env=environment, cwd=package)
    if done.returncode != 0:
        raise SystemExit(f"{item} failed on {package}:\n{done.stderr[-2000:]}")
    return json.loads(done.stdout.strip().splitlines()[-1])


def main(
    names: Sequence[str] = (), quick: bool = False, steps: int = MAX_STEPS, against: str | Path | None = None
) -> dict[str, Any]:
    """Print the table; returns its figures."""
    chosen: list[str] = list(names)
    if not chosen:
        sizes = ("small",) if quick else ("full", "large")
        chosen = [f"{name}:{size}" for size in sizes for name, scene in TORTURE.items() if getattr(scene, size)]
        chosen += SCENES
    other = Path(against).resolve() if against is not None else None
    if other is not None and not (other / "supple" / "__init__.py").exists():
        raise SystemExit(f"--against {against}: the package supple is missing in it; give the folder src of a checkout")
    columns = {"scene": "", "tets": ",.0f", "contacts": ",.0f", "Newton/step": ".1f", "ms/step": ".1f"}
    columns |= {"contact": ".0%", "elasticity": ".0%", "linear systems": ".0%", "not as it should be": ""}
    table = Table("Steps with contact", columns)
    for item in chosen:
        if other is None:
            _add(table, item, measured(case(item), steps))
            continue
        this, that = in_process(item, ROOT / "src", steps), in_process(item, other, steps)
        _add(table, item, this)
        _add(table, "other", that)
        ratios = [that[name] / max(this[name], 1e-300) for name in ("iterations", "seconds")]
        print("other / this, Newton/step and ms/step: ", *(f"{ratio:.2f}" for ratio in ratios), flush=True)
    return table.figures()


def _add(table: Table, item: str, result: dict[str, float]) -> None:
    wrong = {"steps that did not converge": not result["converged"], "surfaces touch": result["nearest"] <= 0.0}
    table.add(
        item,
        *(result["tets"], result["contacts"], result["iterations"], 1e3 * result["seconds"]),
        *(result[name] for name in PARTS),
        ", ".join(text for text, found in wrong.items() if found),
    )


def run() -> None:
    """Measure the small scenes, and print the table."""
    main(quick=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE")
    parser.add_argument("--quick", action="store_true", help="the small scenes, of `make bench`")
    parser.add_argument("--steps", type=int, default=MAX_STEPS, metavar="N", help="of each scene at most")
    parser.add_argument("--against", metavar="PATH", help="the folder src of another checkout")
    given = parser.parse_args()
    if given == parser.parse_args(["--quick"]):
        run()
    else:
        main(given.scenes, given.quick, given.steps, given.against)
