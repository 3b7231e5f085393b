"""Random drops of single parts: least J, statuses and times, by default of the solver that suits each.

usage: python -m benchmarks.drops [--count N] [--first SEED] [--both] [--verify]

A part of E = 1e3 to 1e8 Pa and 5 mm to 1 m, a primitive or one of the shapes that CAD programs and scanners give, meets
a floor with the speed of a fall from up to 2 m, turned at random, in frames of 1/60 s for half a second. A part whose
material can neither carry its weight nor stop from this speed is made stiffer. `--verify` asks `Implicit` with a
quarter of the step wherever a frame is `converged` with J below `CRUSHED`.
"""

from __future__ import annotations

import argparse
import logging
import math
import time
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

import supple as sp
from benchmarks.table import Table
from supple.errors import MeshingError
from supple.model.crushed import CRUSHED

DT, FRAMES = 1 / 60, 30
SHAPES = ("box", "plate", "ball", "cylinder", "torus", "washer", "gear", "bracket", "cup", "blob", "knot", "bear")


def prism(outline: NDArray[np.floating], hole: float | None, height: float, cells: int) -> sp.SurfaceMesh:
    """A plane figure, seen from its center in all directions, as a plate; with a scaled copy of itself as a hole."""
    n = len(outline)
    rings = [outline * s for s in np.linspace(1.0, hole or 0.0, cells + 1)[: cells + (hole is not None)]]
    layers = max(1, round(height * cells))
    flat = np.concatenate(rings)
    points = [np.column_stack([flat[:, 0], np.full(len(flat), y), flat[:, 1]]) for y in (0.0, height)]
    walls = [0] if hole is None else [0, len(rings) - 1]
    heights = np.linspace(0.0, height, layers + 1)[1:-1]
    for wall in walls:
        points += [np.column_stack([rings[wall][:, 0], np.full(n, y), rings[wall][:, 1]]) for y in heights]
    if hole is None:
        points.append(np.array([[0.0, 0.0, 0.0], [0.0, height, 0.0]]))
    triangles = []
    k = np.arange(n)
    next_one = (k + 1) % n

    def strip(a: NDArray, b: NDArray) -> None:
        triangles.append(np.column_stack([a[k], a[next_one], b[next_one]]))
        triangles.append(np.column_stack([a[k], b[next_one], b[k]]))

    side = len(flat)
    for ring in range(len(rings) - 1):
        inner, outer = n * (ring + 1) + k, n * ring + k
        strip(outer, inner)  # below, seen from below
        strip(side + inner, side + outer)
    for w, wall in enumerate(walls):
        first = 2 * side + w * n * len(heights)
        columns = [n * wall + k, *(first + n * i + k for i in range(len(heights))), side + n * wall + k]
        for below, above in pairwise(columns):
            strip(above, below) if w == 0 else strip(below, above)
    if hole is None:
        last = sum(map(len, points))
        inner = n * (len(rings) - 1) + k
        triangles.append(np.column_stack([inner, inner[next_one], np.full(n, last - 2)]))
        triangles.append(np.column_stack([side + inner[next_one], side + inner, np.full(n, last - 1)]))
    surface = sp.SurfaceMesh(np.concatenate(points), np.concatenate(triangles))
    return surface if surface.volume > 0.0 else surface.flipped()


def swept(curve: NDArray[np.float64], radius: float, sides: int) -> sp.SurfaceMesh:
    """A tube about a closed curve (n, 3)."""
    n = len(curve)
    tangents = np.roll(curve, -1, axis=0) - np.roll(curve, 1, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    frames = np.empty((n, 2, 3))
    u = np.cross(tangents[0], [0.3, 0.9, 0.1])
    for i in range(n):
        u = u - (u @ tangents[i]) * tangents[i]
        u = u / np.linalg.norm(u)
        frames[i] = u, np.cross(tangents[i], u)
    # The frame has turned on its way round; each ring takes back its share.
    v = frames[0]
    end = frames[-1, 0] - (frames[-1, 0] @ tangents[0]) * tangents[0]
    twist = -math.atan2(end @ v[1], end @ v[0])
    angles = 2.0 * np.pi * np.arange(sides)[None] / sides + twist * np.arange(n)[:, None] / n
    ring = np.cos(angles)[:, :, None] * frames[:, None, 0] + np.sin(angles)[:, :, None] * frames[:, None, 1]
    points = (curve[:, None] + radius * ring).reshape(-1, 3)
    index = np.arange(n * sides).reshape(n, sides)
    a, b = index, np.roll(index, -1, axis=1)
    c, d = np.roll(b, -1, axis=0), np.roll(a, -1, axis=0)
    triangles = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    surface = sp.SurfaceMesh(points, triangles)
    return surface if surface.volume > 0.0 else surface.flipped()


def surface(kind: str, generator: np.random.Generator) -> sp.SurfaceMesh:
    """A surface of about unit size."""
    angles = 2.0 * np.pi * np.arange(32) / 32
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    if kind == "washer":
        return prism(0.5 * circle, generator.uniform(0.3, 0.8), generator.uniform(0.06, 0.3), 3)
    if kind == "gear":
        teeth = 0.5 - 0.12 * (np.arange(32) % 4 < 2)
        return prism(teeth[:, None] * circle, None, generator.uniform(0.1, 0.5), 4)
    if kind == "bracket":
        t = generator.uniform(0.15, 0.35)
        corners = np.array([(1, -t), (1, t), (t, t), (t, 1), (-t, 1), (-t, -t)])
        sides = [np.linspace(a, b, 6)[:-1] for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
        return prism(0.6 * np.concatenate(sides), None, generator.uniform(0.2, 0.6), 3)
    if kind == "cup":
        wall = generator.uniform(0.06, 0.15)
        s = np.linspace(0.0, 1.0, 7)
        profile = [(0.5, y) for y in s[1:]] + [(0.5 - wall, y) for y in (wall + (1.0 - wall) * s)[::-1]]
        rings = [(0.25, 0.0), (0.5, 0.0), *profile, (0.25, wall)]
        n, points = 24, []
        turn = 2.0 * np.pi * np.arange(n) / n
        for r, y in rings:
            points.append(np.column_stack([r * np.cos(turn), np.full(n, y), r * np.sin(turn)]))
        vertices = np.concatenate([*points, [[0.0, 0.0, 0.0], [0.0, wall, 0.0]]])
        k, one = np.arange(n), (np.arange(n) + 1) % n
        triangles = []
        for i in range(len(rings) - 1):
            a, b = n * i, n * (i + 1)
            triangles += [np.column_stack([a + k, b + k, b + one]), np.column_stack([a + k, b + one, a + one])]
        triangles.append(np.column_stack([np.full(n, n * len(rings)), k, one]))
        last = n * (len(rings) - 1)
        triangles.append(np.column_stack([np.full(n, n * len(rings) + 1), last + one, last + k]))
        made = sp.SurfaceMesh(vertices, np.concatenate(triangles))
        return made if made.volume > 0.0 else made.flipped()
    if kind == "blob":
        ball = sp.shapes.sphere_surface(0.5, 0.12)
        axes, phases = generator.normal(size=(6, 3)) * 5.0, generator.uniform(0.0, 6.0, 6)
        waves = np.sin(ball.vertices @ axes.T + phases).sum(axis=1)
        return sp.SurfaceMesh(ball.vertices * (1.0 + 0.07 * waves[:, None]), ball.triangles)
    if kind == "knot":
        t = 2.0 * np.pi * np.arange(72) / 72
        curve = np.column_stack([np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)])
        return swept(0.17 * curve, generator.uniform(0.06, 0.1), 8)
    return sp.shapes.gummy_bear_surface(height=1.0, resolution=16)


def mesh(kind: str, generator: np.random.Generator) -> sp.TetMesh:
    """A mesh of about unit size."""
    edge = generator.uniform(0.12, 0.25)
    if kind in ("box", "plate"):
        size = (1.0, generator.uniform(0.03, 0.15) if kind == "plate" else generator.uniform(0.3, 1.0), 0.8)
        return sp.shapes.box(size, [max(1, round(s / edge)) for s in size])
    if kind == "ball":
        return sp.shapes.sphere(0.5, edge)
    if kind == "cylinder":
        return sp.shapes.cylinder(generator.uniform(0.15, 0.5), generator.uniform(0.3, 1.0), min(edge, 0.15))
    if kind == "torus":
        return sp.shapes.torus(0.4, generator.uniform(0.1, 0.2), min(edge, 0.1))
    made = surface(kind, generator)
    count = int(generator.uniform(500, 2500))
    try:
        return sp.tetrahedralize(made, tets=count)
    except MeshingError:  # thin walls lose too much where the surface is reduced
        return sp.tetrahedralize(made, max_volume=made.volume / count)


def drop(seed: int) -> tuple[sp.Scene, str]:
    """A scene, and what is in it."""
    generator = np.random.default_rng(seed)
    kind = SHAPES[seed % len(SHAPES)]
    shape = mesh(kind, generator)
    size = 10 ** generator.uniform(math.log10(5e-3), 0.0)
    density, poisson = 1000.0, generator.uniform(0.0, 0.48)
    height = generator.uniform(0.0, 2.0) if generator.uniform() < 0.7 else 0.1 * size
    youngs = 10 ** generator.uniform(3.0, 8.0)
    youngs = max(youngs, density * 9.81 * (2.0 * height + 10.0 * size))
    vertices = shape.vertices * (size / np.ptp(shape.vertices, axis=0).max())
    axis = generator.normal(size=3)
    turn = generator.uniform(0.0, math.pi) * axis / np.linalg.norm(axis)
    damping = float(generator.choice([0.0, 0.01]))
    material = sp.StableNeoHookean(youngs=youngs, poisson=poisson, density=density, damping=damping)
    speed = math.sqrt(2.0 * 9.81 * height)
    part = sp.TetMesh(vertices, shape.tets)
    body = sp.Body("part", part, material, rotation=turn, velocity=(0.0, -speed, 0.0), friction=0.5)
    height_of_center = 0.02 * size + 0.5 * speed * DT - float(body.place(vertices)[:, 1].min())
    body = body.changed(position=(0.0, height_of_center, 0.0))
    what = f"{seed} {kind}: {len(shape.tets)} tets, {size:.3g} m, {youngs:.3g} Pa, nu {poisson:.2g}, {height:.2g} m"
    return sp.Scene([body], [sp.HalfSpace(friction=0.5, name="floor")]), what


@dataclass
class Fall:
    """What a solver made of a drop.

    Attributes
    ----------
    least : the smallest J of frames that are `converged`, at frame `when`; worst : of all frames
    statuses : how many frames had which; solver : which one
    ratio : wall time over the time that was simulated, without what comes before the first frame, such as compilation
    """

    least: float = math.inf
    when: int = 0
    worst: float = math.inf
    statuses: dict[str, int] = field(default_factory=dict)
    ratio: float = 0.0
    solver: str = ""


def fall(scene: sp.Scene, solver: Any, dt: float, frames: int) -> Fall:
    """Simulate a drop."""
    found = Fall()
    for _ in sp.simulate(scene, solver, dt, 1):  # compiles
        pass
    began = time.perf_counter()
    for frame in sp.simulate(scene, solver, dt, frames):
        found.solver = frame.solver.label if frame.solver else ""
        status, J = str(frame.report.status), frame.report.min_det_F
        found.statuses[status] = found.statuses.get(status, 0) + 1
        found.worst = min(found.worst, J)
        if status == "converged" and found.least > J:
            found.least, found.when = J, frame.index
    found.ratio = (time.perf_counter() - began) / (dt * frames)
    return found


def confirmed(scene: sp.Scene, found: Fall) -> bool:
    """Whether `Implicit` with a quarter of the step has a crushed tet until a frame after that of `found`."""
    return fall(scene, sp.Implicit(), DT / 4, 4 * (found.when + 1)).worst < CRUSHED


def main(count: int = 40, first: int = 0, both: bool = False, verify: bool = False) -> dict[str, Any]:
    """Print a row for each drop and solver; returns the figures."""
    logging.disable(logging.WARNING)
    table = Table("Random drops", {"drop": "", "least J": ".3g", "of all": ".3g", "statuses": "", "x real time": ".3g"})
    crushed = []
    for seed in range(first, first + count):
        scene, what = drop(seed)
        for solver in [sp.XPBD(), sp.Implicit()] if both else [None]:
            found = fall(scene, solver, DT, FRAMES)
            statuses = ", ".join(f"{count} {status}" for status, count in found.statuses.items())
            least = found.least if math.isfinite(found.least) else None
            table.add(f"{found.solver} {what}", least, found.worst, statuses, found.ratio)
            if found.least < CRUSHED and not (verify and confirmed(scene, found)):
                crushed.append(f"{found.solver} {seed}")
    table.note(f"`converged` with J below {CRUSHED:g}, not confirmed: {', '.join(crushed) or 'none'}.")
    return table.figures()


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--count", type=int, default=40)
    arguments.add_argument("--first", type=int, default=0)
    arguments.add_argument("--both", action="store_true")
    arguments.add_argument("--verify", action="store_true")
    main(**vars(arguments.parse_args()))
