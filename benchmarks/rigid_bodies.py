"""A soft ball under a plate of 3 kg: free rigid bodies, and obstacles and rigid bodies that move in the same way.

usage: python -m benchmarks.rigid_bodies

The free plate is simulated first. A script then moves the obstacle, and the rigid body, along its path, so that all
scenes have the same deformation and contact. Processor times of steps without the first ones, the fastest of some
rounds in which all scenes take their turns; the ratios are to the obstacles.
"""

from __future__ import annotations

import time
from typing import Any

import supple as sp
from benchmarks.table import circumstances

PLATE = sp.shapes.box_surface((0.3, 0.02, 0.3), (4, 1, 4))
RADIUS, GAP = 0.1, 5e-4
HEIGHT = RADIUS + 0.01 + GAP
STEP = 1 / 60  # [s]
KINDS = ("obstacles", "scripted bodies", "free bodies")
SOLVERS = {"Implicit": sp.Implicit(), "XPBD": sp.XPBD()}


def scene(kind: str, edge: float, path: sp.Keyframes | None = None) -> sp.Scene:
    """The ball is pressed together by the upper plate, which `path` moves unless it is free."""
    ball = sp.Body("ball", sp.shapes.sphere(RADIUS, edge), sp.StableNeoHookean(youngs=5e4, poisson=0.4), friction=0.3)
    places = {"lower": ((0, -HEIGHT, 0), None), "upper": ((0, HEIGHT, 0), path)}
    if kind == "obstacles":
        plates = [
            sp.obstacles.TriangleObstacle(
                sp.SurfaceMesh(PLATE.vertices + place, PLATE.triangles), friction=0.3, motion=motion, name=name
            )
            for name, (place, motion) in places.items()
        ]
        return sp.Scene([ball], obstacles=plates)
    bodies = [sp.RigidBody(name, PLATE, mass=3.0, position=place, friction=0.3) for name, (place, _) in places.items()]
    held = [sp.Pin(name, motion=motion) for name, (_, motion) in places.items() if kind != "free bodies"]
    if kind == "free bodies":
        held = [sp.Pin("lower")]
    return sp.Scene([ball, *bodies], pins=held)


def path_of_the_free_plate(solver: sp.Implicit | sp.XPBD, edge: float, steps: int) -> sp.Keyframes:
    """Where the upper plate is at the end of every step."""
    times, ways = [0.0], [[0.0, 0.0, 0.0]]
    for frame in sp.simulate(scene("free bodies", edge), solver, STEP, steps):
        times.append(frame.time)
        ways.append((frame.poses["upper"].translation - (0, HEIGHT, 0)).tolist())
    return sp.Keyframes(times, displacements=ways)


def seconds_per_step(scene: sp.Scene, solver: sp.Implicit | sp.XPBD, steps: int, skipped: int) -> tuple[float, float]:
    """The mean time of a step [s], and of its iterations of Newton's method or its substeps."""
    iterations, began = 0, 0.0
    for frame in sp.simulate(scene, solver, STEP, steps):
        if frame.report.status != "converged":
            raise RuntimeError(frame.report.message)
        if frame.index > skipped:
            iterations += frame.report.iterations
        elif frame.index == skipped:
            began = time.process_time()
    count = steps - skipped
    return (time.process_time() - began) / count, iterations / count


def main(edge: float = 0.03, steps: int = 30, skipped: int = 4, rounds: int = 3) -> dict[str, Any]:
    """Print the table; returns its figures."""
    at_start = circumstances()
    tets = len(scene("free bodies", edge).bodies[0].mesh.tets)
    print(f"\na ball of {tets} tets between two plates")
    print(f"{'solver':10}{'plates':18}{'ms/step':>9}{'per step':>13}{'ratio':>8}")
    solvers: dict[str, Any] = {}
    for name, solver in SOLVERS.items():
        path = path_of_the_free_plate(solver, edge, steps)
        scenes = {kind: scene(kind, edge, path) for kind in KINDS}
        best: dict[str, tuple[float, float]] = {}
        for _ in range(rounds):
            for kind, one in scenes.items():
                best[kind] = min(best.get(kind, (float("inf"), 0.0)), seconds_per_step(one, solver, steps, skipped))
        for kind, (seconds, iterations) in best.items():
            ratio = seconds / best["obstacles"][0]
            print(f"{name:10}{kind:18}{1e3 * seconds:9.1f}{iterations:13.1f}{ratio:8.2f}")
        solvers[name] = {
            kind: {"ms_per_step": 1e3 * seconds, "iterations": count} for kind, (seconds, count) in best.items()
        }
    return {**at_start, "tets": tets, "solvers": solvers}


def run() -> None:
    """Measure, and print the table."""
    main()


if __name__ == "__main__":
    run()
