"""Published cases in other programs, on the same nodes and tets.

usage: python -m benchmarks.published_against [PROGRAM ...] [--cases NAME ...] [--publish]

The programs are those of `PROGRAMS`; `make peers` installs them into environments of their own. Elements are linear
tets, which all of them have, on the nodes of the quadratic tets of tests/published. Each program has settings that make
it as exact as it gets in about a minute, not its defaults. With --publish, the figures go to
docs/figures/published/peers; `python -m benchmarks.published --page` then shows them.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tests.published import bar_impact, bend, cook, rolling
from tests.published.case import Reference
from tests.solvers.implicit.contact import test_hertz as ball

import supple as sp
from benchmarks.measuring import PEERS_PYTHON, SUPERDEX_PYTHON, run_json
from benchmarks.published import PEERS as FIGURES
from benchmarks.published import number, write
from benchmarks.table import Table, circumstances
from supple.numerics.quadratic_shape_functions import BETWEEN

PEERS = Path(__file__).parent / "peers"
sys.path.insert(0, str(PEERS))
problems: Any = import_module("published_problem")
Arrays = Mapping[str, NDArray[np.float64]]

# Metres for an inch, and for Cook's unit; the modulus of both is 1 MPa. Loads are scaled with them, so that programs
# with float32 and constants in metres have numbers that they are made for. Statics does not change by this.
INCH, COOK, MODULUS = 0.1, 0.01, 1e6
COOK_LOAD = 1e-3  # of Cook's unit force: small, and above the round-off of float32


@dataclass(frozen=True)
class Compared:
    """A case: what other programs solve, and what is read from their answers, with references by quantity."""

    title: str
    references: Mapping[str, Reference]
    problem: Callable[[], Any]
    values: Callable[[Any, Arrays], Mapping[str, Any]]


def linear(mesh: sp.TetMesh) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The nodes of quadratic tets, and the eight linear tets between the nodes of each."""
    nodes = np.asarray(mesh.nodes, dtype=np.int64)
    ab, bc, ac, ad, bd, cd = (int(BETWEEN[p]) for p in ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)))
    local = [[0, ab, ac, ad], [ab, 1, bc, bd], [ac, bc, 2, cd], [ad, bd, cd, 3]]
    local += [
        [ab, cd, ac, ad],
        [ab, cd, bc, ac],
        [ab, cd, bd, bc],
        [ab, cd, ad, bd],
    ]  # around ab to cd
    tets = nodes[:, local].reshape(-1, 4)
    x = np.asarray(mesh.vertices)
    inverted = np.linalg.det(x[tets[:, 1:]] - x[tets[:, :1]]) < 0
    tets[inverted] = tets[inverted][:, [1, 0, 2, 3]]
    return x, tets


def shared(x: NDArray[np.float64], tets: NDArray[np.int64], face: NDArray[np.bool_], force: Any) -> Any:
    """(n, 3) a force [N] that is constant over the plane face whose nodes are a mask (n,)."""
    mesh = sp.TetMesh(x, tets)
    triangles = mesh.surface.triangles[face[mesh.surface.triangles].all(axis=1)]
    areas = np.linalg.norm(np.cross(*(x[triangles[:, 1:]] - x[triangles[:, :1]]).swapaxes(0, 1)), axis=1)
    weights = np.bincount(triangles.ravel(), np.repeat(areas, 3), len(x))
    return np.outer(weights / weights.sum(), force)


def clamped(x: NDArray[np.float64], tets: NDArray[np.int64], pinned: NDArray[np.bool_], forces: Any, nu: float) -> Any:
    """A static problem with `pinned` (n,), a mask, held."""
    held = np.flatnonzero(pinned)
    return problems.Problem("static", x, tets, youngs=MODULUS, poisson=nu, pinned=held, moved=x[held], forces=forces)


def bend_ends(x: NDArray[np.float64]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """The nodes of the clamp and of the loaded end."""
    angle = np.arctan2(x[:, 1], bend.RADIUS * INCH - x[:, 0])
    return angle < 1e-9, angle > np.pi / 4 - 1e-9


def bend_problem() -> Any:
    x, tets = linear(bend.arc((64, 1, 1)))
    x = x * INCH
    clamp, end = bend_ends(x)
    force = 600.0 / 1e7 * MODULUS * INCH**2
    return clamped(x, tets, clamp, shared(x, tets, end, (0.0, 0.0, force)), 0.0)


def bend_values(problem: Any, found: Arrays) -> dict[str, Any]:
    _, end = bend_ends(problem.points)
    middle = (problem.points[end].min(axis=0) + problem.points[end].max(axis=0)) / 2
    tip = np.flatnonzero(end)[np.linalg.norm(problem.points[end] - middle, axis=1).argmin()]
    return {"place at 600 lb": found["positions"][tip] / INCH}


def cook_problem() -> Any:
    x, tets = linear(cook.panel(16, 1.0))
    x = x * COOK
    end = x[:, 0] > 48 * COOK - 1e-9
    force = COOK_LOAD * MODULUS * COOK**2
    return clamped(x, tets, x[:, 0] < 1e-9, shared(x, tets, end, (0.0, force, 0.0)), 1 / 3)


def cook_values(problem: Any, found: Arrays) -> dict[str, Any]:
    x = problem.points
    middle = (x[:, 0] > 48 * COOK - 1e-9) & (np.abs(x[:, 1] - 52 * COOK) < 1e-6)
    return {"deflection": (found["positions"] - x)[middle, 1].mean() / (COOK * COOK_LOAD)}


def bar_problem() -> Any:
    size = (bar_impact.SIDE, bar_impact.LENGTH, bar_impact.SIDE)
    mesh = sp.shapes.box(size, (1, 40, 1))
    x = mesh.vertices + np.array([0, bar_impact.LENGTH / 2 + 0.002, 0])
    return problems.Problem(
        "impact", x, np.asarray(mesh.tets, dtype=np.int64), youngs=bar_impact.YOUNGS, poisson=0.0,
        density=bar_impact.DENSITY, velocity=(0.0, -bar_impact.SPEED, 0.0), floor=True,
        time=0.03 + 1.3 * bar_impact.LASTS,
    )  # fmt: skip


def bar_values(problem: Any, found: Arrays) -> dict[str, Any]:
    rises = found["velocities"][:, 1] / bar_impact.SPEED
    flying = int(np.argmax(rises < -0.9))  # the program may have had to accelerate it
    rising = np.maximum.accumulate(rises[flying:])
    times = [float(np.interp(level, rising, found["times"][flying:])) for level in (-0.5, 0.5)]
    return {
        "contact lasts": 2 * (times[1] - times[0]) / bar_impact.LASTS if rises.max() > 0.5 else np.nan,
        "speed after it": rises[-1],
        "deepest below the wall": 1e3 * max(0.0, -float(found["lowest"].min())),
    }


def hertz_problem() -> Any:
    mesh, held = ball.graded_block(4)
    x, tets = linear(mesh)
    moved = x[held] + ball.boussinesq(x[held], ball.hertz(ball.APPROACH)) - [0, ball.APPROACH, 0]
    return problems.Problem(
        "static", x, tets, youngs=ball.YOUNGS, poisson=ball.POISSON, pinned=held, moved=moved,
        forces=np.zeros_like(x), floor=True,
    )  # fmt: skip


def elastic_forces(problem: Any, positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 3) what holds linear tets of St. Venant and Kirchhoff's law at their positions [N]."""
    x, tets = problem.points, problem.tets
    lam, mu = problem.lame()
    Dm, Ds = (np.swapaxes(y[tets[:, 1:]] - y[tets[:, :1]], 1, 2) for y in (x, positions))
    inverse = np.linalg.inv(Dm)
    F = Ds @ inverse
    E = (np.swapaxes(F, 1, 2) @ F - np.eye(3)) / 2
    P = F @ (lam * np.trace(E, axis1=1, axis2=2)[:, None, None] * np.eye(3) + 2 * mu * E)
    of_corners = (np.linalg.det(Dm) / 6)[:, None, None] * P @ np.swapaxes(inverse, 1, 2)
    result = np.zeros_like(x)
    for k in range(3):
        np.add.at(result, tets[:, k + 1], of_corners[:, :, k])
        np.add.at(result, tets[:, 0], -of_corners[:, :, k])
    return result


def hertz_values(problem: Any, found: Arrays) -> dict[str, Any]:
    if "contact_points" in found:
        points, forces = found["contact_points"], found["contact_forces"][:, 1]
    else:  # what holds the free nodes of the ball's face is the contact
        x = problem.points
        free = np.setdiff1d(np.flatnonzero(x[:, 1] < 2 * ball.APPROACH + ball.CONTACT**2), problem.pinned)
        points, forces = found["positions"][free], elastic_forces(problem, found["positions"])[free, 1]
        points, forces = points[forces > 0], forces[forces > 0]
    if not len(forces):
        return dict.fromkeys(("radius of contact", "pressure in the middle", "overlap"), np.nan)
    force = float(forces.sum())
    d = ball.APPROACH + forces @ points[:, 1] / force
    radius = np.sqrt(2.5 * (forces @ (points[:, 0] ** 2 + points[:, 2] ** 2) / force)) / ball.CONTACT
    share = np.sqrt(max(d, 1e-12) / ball.APPROACH)  # of the radius and of the pressure, by the way that is left
    return {
        "radius of contact": radius / share,
        "pressure in the middle": 279.83 * force / ball.hertz(max(d, 1e-12)) / (radius / share) ** 2,
        "overlap": max(0.0, 1 - d / ball.APPROACH),
    }


def rolling_problem() -> Any:
    surface = sp.shapes.sphere_surface(rolling.RADIUS, rolling.CASE.meshes[1][1] * rolling.RADIUS)
    return problems.Problem(
        "rolling", surface.vertices, np.asarray(surface.triangles, dtype=np.int64), velocity=(rolling.SPEED, 0.0, 0.0),
        gravity=(0.0, -rolling.G, 0.0), time=0.13, floor=True, radius=rolling.RADIUS, friction=rolling.MU,
    )  # fmt: skip


def rolling_values(problem: Any, found: Arrays) -> dict[str, Any]:
    last = found["times"] > problem.time * 5 / 6
    return {"speed": found["velocities"][last, 0].mean() / rolling.SPEED}


CASES = {
    "bend": Compared(
        "45 degree bend, 600 lb", {"place at 600 lb": bend.REFERENCES["place at 600 lb"]}, bend_problem, bend_values
    ),
    "cook": Compared("Cook's membrane, plane stress", cook.CASE.references, cook_problem, cook_values),
    "bar_impact": Compared(
        "Bar against a wall",
        {
            "contact lasts": Reference(1.0, "2 L / c"),
            "speed after it": Reference(1.0, "v"),
            "deepest below the wall": Reference(0.0, "mm", scale=np.inf),
        },
        bar_problem,
        bar_values,
    ),
    "hertz": Compared(
        "Hertz: ball on plane",
        {
            "radius of contact": Reference(1.0, "mm"),
            "pressure in the middle": Reference(279.83, "MPa"),
            "overlap": Reference(0.0, "approach", scale=1.0),
        },
        hertz_problem,
        hertz_values,
    ),
    "rolling": Compared(
        "Ball from sliding to rolling", {"speed": Reference(5 / 7, "v")}, rolling_problem, rolling_values
    ),
}


def ours(solver: str) -> Callable[[str, Any, Path], dict[str, Any]]:
    """Solves a problem with a solver of Supple."""

    def run(name: str, problem: Any, out: Path) -> dict[str, Any]:
        about = {"version": sp.__version__}
        xpbd, setting = solver == "XPBD", rolling.CASE.meshes[1]
        if xpbd and problem.kind == "static":
            return about | {"refused": "XPBD has no statics"}
        began = time.process_time()
        if problem.kind == "rolling":
            frames = rolling.frames_of(setting, rolling.SOLVERS[solver])
            velocities = [frame.poses["ball"].velocity for frame in frames]
            np.savez(out, times=[frame.time for frame in frames], velocities=velocities)
            settings = f"steps of {1e3 * setting[0]:g} ms"
        elif problem.kind == "impact":
            body = sp.Body("body", sp.TetMesh(problem.points, problem.tets), law(problem), velocity=problem.velocity)
            scene = sp.Scene([body], [sp.HalfSpace(name="wall")], gravity=(0, 0, 0))
            dt, mass = bar_impact.LASTS / 640, problem.masses().sum()
            frames = list(sp.simulate(scene, bar_impact.SOLVERS[solver], dt, round(problem.time / dt)))
            np.savez(
                out,
                times=[frame.time for frame in frames],
                velocities=[frame.report.linear_momentum / mass for frame in frames],
                lowest=[frame.positions["body"][:, 1].min() for frame in frames],
            )
            settings = f"defaults, frames of {1e3 * dt:.2g} ms"
        else:
            frame = static_frame(problem)
            arrays: dict[str, Any] = {"positions": frame.positions["body"]}
            if problem.floor:
                assert frame.contacts is not None
                above = np.outer(frame.contacts.distances, [0, 1, 0])
                arrays |= {
                    "contact_points": frame.contacts.points * [1, 0, 1] + above,
                    "contact_forces": frame.contacts.forces,
                }
            np.savez(out, **arrays)
            settings = "one static step"
        return about | {"settings": settings, "seconds": time.process_time() - began}

    return run


def law(problem: Any) -> Any:
    """The material of a problem."""
    kind = sp.StVenantKirchhoff if problem.kind == "static" else sp.StableNeoHookean
    return kind(youngs=problem.youngs, poisson=problem.poisson, density=problem.density)


def static_frame(problem: Any) -> sp.Frame:
    """The equilibrium of a static problem; above a floor, the body begins higher by more than the reach of contact."""
    x, held = problem.points, problem.pinned
    lift = np.array([0.0, 1.1 * ball.DHAT if problem.floor else 0.0, 0.0])
    loaded = np.flatnonzero(np.linalg.norm(problem.forces, axis=1) > 0)
    scene = sp.Scene(
        [sp.Body("body", sp.TetMesh(x, problem.tets), law(problem), position=lift)],
        [sp.HalfSpace(name="floor")] if problem.floor else [],
        pins=[sp.Pin("body", held, motion=lambda t: t * (problem.moved - x[held] - lift))],
        loads=[sp.Force("body", loaded, problem.forces[loaded])] if len(loaded) else [],
        gravity=(0, 0, 0),
    )
    contact = sp.IPCContact(dhat=ball.DHAT) if problem.floor else None
    (frame,) = sp.simulate(scene, sp.Implicit(integrator="static", contact=contact), 1.0, 1, strict=True)
    return frame


def theirs(python: Path, script: str) -> Callable[[str, Any, Path], dict[str, Any]]:
    """Runs a script in the environment of another program."""

    def run(name: str, problem: Any, out: Path) -> dict[str, Any]:
        given = out.with_name(f"{name}_problem.npz")
        problems.write(given, problem)
        return run_json(python, PEERS / script, given, out)

    return run


PROGRAMS = {
    "Supple Implicit": ours("Implicit"),
    "Supple XPBD": ours("XPBD"),
    "SuperDex": theirs(SUPERDEX_PYTHON, "published_superdex.py"),
    "MuJoCo": theirs(PEERS_PYTHON, "published_mujoco.py"),
    "Newton VBD": theirs(PEERS_PYTHON, "published_newton.py"),
    "PyBullet": theirs(PEERS_PYTHON, "published_pybullet.py"),
}
COLUMNS = {
    "case": "", "quantity": "", "reference": "", "program": "", "value": "", "error": ".2%", "seconds": ".1f",
    "settings": "",
}  # fmt: skip


def measure(program: str, cases: list[str], folder: Path) -> dict[str, list[list[Any]]]:
    """Run a program; its rows by case."""
    rows: dict[str, list[list[Any]]] = {}
    table = Table(program, COLUMNS)
    for name in cases:
        case, first = CASES[name], len(table.rows)
        problem, out = case.problem(), folder / f"{name}_{program.lower().replace(' ', '_')}.npz"
        about = PROGRAMS[program](name, problem, out)
        label = f"{program} {about['version']}"
        if "refused" in about:
            table.add(case.title, "", "", label, f"cannot run: {about['refused']}", None, None, "")
        else:
            with np.load(out) as found:
                values = case.values(problem, found)
            for key, reference in case.references.items():
                value = values[key]
                error = None if reference.scale == np.inf or not np.isfinite(value).all() else reference.error(value)
                shown = number(value) if np.isfinite(value).all() else "none"
                table.add(
                    case.title, f"{key} [{reference.unit}]", number(reference.value), label, shown, error,
                    about["seconds"], about["settings"],
                )  # fmt: skip
        rows[name] = table.rows[first:]
    return rows


def file_of(program: str) -> Path:
    """Where the figures of a program are."""
    return FIGURES / f"{program.lower().replace(' ', '_')}.json"


def main(programs: list[str], cases: list[str], publish: bool) -> None:
    """Run, print, and write the figures; cases that are not run keep theirs."""
    for program in programs:
        with tempfile.TemporaryDirectory() as folder:
            rows = measure(program, cases, Path(folder))
        if publish:
            path = file_of(program)
            before = json.loads(path.read_text(encoding="utf-8"))["rows"] if path.exists() else {}
            figures = circumstances(1) | {"program": program, "columns": COLUMNS, "rows": before | rows}
            write(path, json.dumps(figures, indent=1) + "\n")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Solve published cases in other programs.")
    parser.add_argument("programs", nargs="*", default=list(PROGRAMS), metavar="program")
    parser.add_argument("--cases", nargs="+", choices=list(CASES), default=list(CASES))
    parser.add_argument("--publish", action="store_true")
    given = parser.parse_args()
    main(given.programs, given.cases, given.publish)
