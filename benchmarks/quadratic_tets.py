"""Error against time: linear and quadratic tets on Cook's membrane, a cantilever and a twisted bar.

usage: python -m benchmarks.quadratic_tets

Each line is one mesh: its tets, the error against the finest quadratic mesh, and the processor time of the static
solution, the faster of two rounds, in which all meshes take their turns. Then the best linear mesh of each problem is
compared with the fastest quadratic one that is at least as good.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import supple as sp
from benchmarks.publishing import publish
from benchmarks.table import Table

STATIC = sp.Implicit(integrator="static", contact=None)
SMALL = 1e-4


@dataclass(frozen=True)
class Problem:
    """A problem on meshes of any size.

    Attributes
    ----------
    solve : (size, order) -> tets, result, seconds
    linear, quadratic : the sizes that are compared; reference : size of the finest quadratic mesh
    """

    name: str
    solve: Callable[[int, int], tuple[int, float, float]]
    linear: tuple[int, ...]
    quadratic: tuple[int, ...]
    reference: int


def solved(scene: sp.Scene, steps: int = 1) -> tuple[sp.Frame, float]:
    """The equilibrium, and the time that it took, preparation included [s]."""
    began = time.process_time()
    *_, frame = sp.simulate(scene, STATIC, 1.0 / steps, steps)
    if frame.report.status != "converged":
        raise RuntimeError(frame.report.message)
    return frame, time.process_time() - began


def end_triangles(mesh: sp.TetMesh, x: float) -> NDArray[np.int64]:
    """Rows of the surface's triangles at the largest coordinate x."""
    return np.flatnonzero((mesh.vertices[mesh.surface.triangles][:, :, 0] > x - 1e-9).all(axis=1))


def cook(poisson: float, cells: int, order: int) -> tuple[int, float, float]:
    """Deflection of the middle of the loaded end of Cook's membrane, per load; cells are smaller at the clamp."""
    unit = sp.shapes.box((1, 1, 1), (cells, cells, max(1, cells // 8)))
    X = unit.vertices + 0.5
    s, t = X[:, 0] ** 2, 1.0 - X[:, 1]
    t = np.where(t < 0.5, 0.5 * (2 * t) ** 1.5, 1 - 0.5 * np.maximum(2 * (1 - t), 0.0) ** 1.5)
    places = np.column_stack([48 * s, 44 * s + t * (44 - 28 * s), 10 * X[:, 2]])
    mesh = sp.TetMesh(places, unit.tets).to_order(order)
    x = mesh.vertices
    scene = sp.Scene(
        [sp.Body("cook", mesh, sp.StableNeoHookean(youngs=1.0, poisson=poisson))],
        pins=[sp.Pin("cook", np.flatnonzero(x[:, 0] < 1e-9))],
        loads=[sp.Traction("cook", (0.0, SMALL / 16, 0.0), end_triangles(mesh, 48.0))],
        gravity=(0, 0, 0),
    )
    frame, seconds = solved(scene)
    middle = (x[:, 0] > 48 - 1e-9) & (np.abs(x[:, 1] - 52) < 1e-6)
    return len(mesh.tets), float((frame.positions["cook"] - x)[middle, 1].mean() / SMALL), seconds


def cantilever(across: int, order: int) -> tuple[int, float, float]:
    """Deflection of the tip of a square bar, ten times as long as wide, over Timoshenko's; graded to the clamp."""
    length, side, youngs, nu, load = 1.0, 0.1, 1e6, 0.3, 0.01
    unit = sp.shapes.box((1, side, side), (7 * across, across, across))
    x = unit.vertices.copy()
    x[:, 0] = length * (x[:, 0] + 0.5) ** 1.5
    mesh = sp.TetMesh(x, unit.tets).to_order(order)
    x = mesh.vertices
    scene = sp.Scene(
        [sp.Body("bar", mesh, sp.StableNeoHookean(youngs=youngs, poisson=nu))],
        pins=[sp.Pin("bar", np.flatnonzero(x[:, 0] < 1e-9))],
        loads=[sp.Traction("bar", (0.0, -load / side**2, 0.0), end_triangles(mesh, length))],
        gravity=(0, 0, 0),
    )
    frame, seconds = solved(scene)
    kappa = 10 * (1 + nu) / (12 + 11 * nu)
    theory = 4 * load * length**3 / (youngs * side**4) + load * length / (kappa * youngs / (2 + 2 * nu) * side**2)
    moved = frame.positions["bar"] - x
    return len(mesh.tets), float(-moved[x[:, 0] > length - 1e-9, 1].mean() / theory), seconds


def twist(across: int, order: int) -> tuple[int, float, float]:
    """Elastic energy of a square bar, three times as long as wide, that is twisted by a quarter turn."""
    mesh = sp.shapes.box((3, 1, 1), (3 * across, across, across), order=order)
    x = mesh.vertices[:, 0]
    turn = sp.Keyframes([0.0, 1.0], angles=[0.0, np.pi / 2], axis=(1, 0, 0))
    scene = sp.Scene(
        [sp.Body("bar", mesh, sp.StableNeoHookean(youngs=1.0, poisson=0.45))],
        pins=[sp.Pin("bar", np.flatnonzero(x < -1.5 + 1e-9)), sp.Pin("bar", np.flatnonzero(x > 1.5 - 1e-9), turn)],
        gravity=(0, 0, 0),
    )
    frame, seconds = solved(scene, 2)
    return len(mesh.tets), frame.report.elastic_energy, seconds


PROBLEMS = (
    Problem("Cook's membrane, nu = 1/3", lambda n, order: cook(1 / 3, n, order), (16, 32), (2, 4), 16),
    Problem("Cook's membrane, nu = .499", lambda n, order: cook(0.499, n, order), (16, 32), (2, 4), 16),
    Problem("cantilever, nu = .3", cantilever, (8, 12), (1, 2), 5),
    Problem("bar twisted by a quarter turn, nu = .45", twist, (8, 16), (2, 4), 7),
)


def measure(problem: Problem, rounds: int = 2) -> list[tuple[int, int, int, float, float]]:
    """Order, size, tets, relative error and seconds of each mesh."""
    exact = problem.solve(problem.reference, 2)[1]
    meshes = [(1, n) for n in problem.linear] + [(2, n) for n in problem.quadratic]
    best: dict[tuple[int, int], tuple[int, float, float]] = {}
    for _ in range(rounds):
        for order, n in meshes:
            tets, value, seconds = problem.solve(n, order)
            if (order, n) not in best or seconds < best[order, n][2]:
                best[order, n] = tets, abs(value / exact - 1.0), seconds
    return [(order, n, *best[order, n]) for order, n in meshes]


def main(problems: tuple[Problem, ...] = PROBLEMS, rounds: int = 2) -> dict[str, Any]:
    """Print the table; returns its figures."""
    columns = {"problem": "", "tets": "", "across": "d", "number": ",d", "error": ".2%", "seconds": ".3f"}
    table = Table("Linear and quadratic tets; seconds of the processor", columns)
    for problem in problems:
        rows = measure(problem, rounds)
        for order, n, tets, error, seconds in rows:
            table.add(problem.name, ("linear", "quadratic")[order - 1], n, tets, error, seconds)
        _, _, tets, error, seconds = min((row for row in rows if row[0] == 1), key=lambda row: row[3])
        good = [row for row in rows if row[0] == 2 and row[3] <= error]
        if good:
            other = min(good, key=lambda row: row[4])
            table.note(
                f"{problem.name}: {other[2]} quadratic tets are as good as {tets} linear ones, "
                f"{seconds / other[4]:.1f} times as fast."
            )
    return table.figures()


def run() -> None:
    """Measure, and write the figures of docs/theory/locking.md: a problem of volume and one of bending."""
    main((PROBLEMS[0], PROBLEMS[3]))
    publish("quadratic_tets", main(PROBLEMS[1:3]))


if __name__ == "__main__":
    run()
