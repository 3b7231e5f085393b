"""A soft ball between two plates: obstacles that a script moves, rigid bodies that it moves, and free rigid bodies.

usage: python -m benchmarks.rigid_bodies

Processor times of steps of `Implicit`, without the first ones, the fastest of some rounds in which all scenes
take their turns; the ratios are to the obstacles.
"""

from __future__ import annotations

import time
from typing import Any

import supple as sp
from benchmarks.published import publish
from benchmarks.table import circumstances

PLATE = sp.shapes.box_surface((0.3, 0.02, 0.3), (4, 1, 4))
RADIUS, GAP = 0.1, 5e-4
KINDS = ("obstacles", "scripted bodies", "free bodies")


def scene(kind: str, edge: float) -> sp.Scene:
    """The ball is pressed together by 2 cm in a second, in free bodies by the weight of the upper one."""
    ball = sp.Body("ball", sp.shapes.sphere(RADIUS, edge), sp.StableNeoHookean(youngs=5e4, poisson=0.4), friction=0.3)
    height = RADIUS + 0.01 + GAP
    press = sp.Keyframes([0.0, 1.0], displacements=[[0, 0, 0], [0, -0.02, 0]])
    places = {"lower": ((0, -height, 0), None), "upper": ((0, height, 0), press)}
    if kind == "obstacles":
        plates = [
            sp.TriangleObstacle(
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


def seconds_per_step(kind: str, edge: float, steps: int, skipped: int) -> tuple[float, float]:
    """The mean time of a step [s], and of its iterations of Newton's method."""
    frames = sp.simulate(scene(kind, edge), sp.Implicit(), 1 / 60, steps)
    iterations, began = 0, 0.0
    for frame in frames:
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
    best: dict[str, tuple[float, float]] = {}
    for _ in range(rounds):
        for kind in KINDS:
            best[kind] = min(best.get(kind, (float("inf"), 0.0)), seconds_per_step(kind, edge, steps, skipped))
    tets = len(scene("obstacles", edge).bodies[0].mesh.tets)
    print(f"\na ball of {tets} tets between two plates")
    print(f"{'plates':18}{'ms/step':>9}{'Newton/step':>13}{'ratio':>8}")
    for kind, (seconds, iterations) in best.items():
        print(f"{kind:18}{1e3 * seconds:9.1f}{iterations:13.1f}{seconds / best['obstacles'][0]:8.2f}")
    plates = {kind: {"ms_per_step": 1e3 * seconds, "iterations": count} for kind, (seconds, count) in best.items()}
    return {**at_start, "tets": tets, "plates": plates}


def run() -> None:
    """Measure, and write the figures of docs/benchmarks.md."""
    publish("rigid_bodies", main())


if __name__ == "__main__":
    run()
