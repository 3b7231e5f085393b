"""A soft ball between two plates: obstacles that a script moves, rigid bodies that it moves, and free rigid bodies.

usage: python -m benchmarks.rigid_bodies

Times of steps of `Implicit`, without the first ones, the fastest of some rounds in which all scenes take their turns;
the ratios are to the obstacles.
"""

from __future__ import annotations

import time

import supple as sp

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
            began = time.perf_counter()
    count = steps - skipped
    return (time.perf_counter() - began) / count, iterations / count


def main(edge: float = 0.03, steps: int = 30, skipped: int = 4, rounds: int = 3) -> dict[str, float]:
    """Print the table; returns the ratio of each kind to the obstacles."""
    best: dict[str, tuple[float, float]] = {}
    for _ in range(rounds):
        for kind in KINDS:
            best[kind] = min(best.get(kind, (float("inf"), 0.0)), seconds_per_step(kind, edge, steps, skipped))
    print(f"\na ball of {len(scene('obstacles', edge).bodies[0].mesh.tets)} tets between two plates")
    print(f"{'plates':18}{'ms/step':>9}{'Newton/step':>13}{'ratio':>8}")
    ratios = {}
    for kind, (seconds, iterations) in best.items():
        ratios[kind] = seconds / best["obstacles"][0]
        print(f"{kind:18}{1e3 * seconds:9.1f}{iterations:13.1f}{ratios[kind]:8.2f}")
    return ratios


if __name__ == "__main__":
    main()
