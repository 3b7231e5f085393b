"""What the tolerance of a step costs, and what it does to trajectories and forces.

usage: python -m benchmarks.tolerances [STEPS]

Every scene runs with several tolerances and is compared with a run of tolerance 1e-7. Errors are the largest ones over
all steps: of positions, relative to the body's diagonal, and of the force of contact on the bodies, relative to their
weight. Scenes in which surfaces bounce amplify errors, so that differences grow with the number of steps.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

import supple as sp
from benchmarks.table import Table
from supple.solvers.implicit.details import ImplicitDetails

TOLERANCES = (None, 1e-1, 1e-2, 1e-3, 1e-4)
REFERENCE = 1e-7
DT = 1 / 100


def _ball() -> sp.Scene:
    """A soft ball of 20 cm that rolls and slides on a plane."""
    rubber = sp.StableNeoHookean(youngs=1e5, poisson=0.4, density=1000.0)
    ball = sp.Body("ball", sp.shapes.sphere(0.1, 0.06), rubber, position=(0, 0.101, 0), velocity=(1, 0, 0))
    return sp.Scene([ball], [sp.HalfSpace(friction=0.5)])


def _stack() -> sp.Scene:
    """Three cubes of different stiffness on each other."""
    cube = sp.shapes.box((0.1, 0.1, 0.1), (2, 2, 2))
    bodies = [
        sp.Body(
            f"cube {k}",
            cube,
            sp.StableNeoHookean(youngs=10.0 ** (4 + k % 2), poisson=0.4, density=1000.0),
            position=(0.01 * k, 0.0505 + 0.1005 * k, 0),
            friction=0.5,
        )
        for k in range(3)
    ]
    return sp.Scene(bodies, [sp.HalfSpace(friction=0.5)])


SCENES = {"ball": _ball, "stack": _stack}


def run(scene: sp.Scene, tolerance: float | None, steps: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Positions (steps, n, 3), forces of contact on the bodies (steps, b, 3) [N], and Newton iterations a step."""
    positions, forces, iterations = [], [], 0
    for frame in sp.simulate(scene, sp.Implicit(tolerance=tolerance), DT, steps):
        details = frame.report.details
        assert isinstance(details, ImplicitDetails)
        if frame.time == 0.0:
            continue
        positions.append(np.concatenate([frame.positions[body.name] for body in scene.bodies]))
        forces.append([details.contact_forces[body.name] for body in scene.bodies])
        iterations += frame.report.iterations
    return np.array(positions), np.array(forces), iterations / steps


def main(steps: int = 20) -> dict[str, Any]:
    """Print the table; returns its figures."""
    columns = {"scene": "", "`tolerance`": "", "Newton a step": ".1f", "positions": ".1e", "forces": ".1e"}
    table = Table(f"Largest errors in {steps} steps", columns)
    for name, scene in SCENES.items():
        exact, exact_forces, _ = run(scene(), REFERENCE, steps)
        diagonal = float(np.linalg.norm(np.ptp(scene().bodies[0].mesh.vertices, axis=0)))
        weight = 9.81 * 1000.0 * sum(float(body.mesh.volume) for body in scene().bodies)
        for tolerance in TOLERANCES:
            x, f, iterations = run(scene(), tolerance, steps)
            moved = np.abs(x - exact).max() / diagonal
            pushed = np.abs(f - exact_forces).max() / weight
            table.add(name, "default" if tolerance is None else f"{tolerance:.0e}", iterations, moved, pushed)
    return table.figures()


def write() -> None:
    """Measure, and print the table."""
    main()


if __name__ == "__main__":
    if sys.argv[1:]:
        main(*map(int, sys.argv[1:]))
    else:
        write()
