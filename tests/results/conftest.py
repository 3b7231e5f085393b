"""A small scene, and a solver that moves it along known paths, so that tests of output do not depend on solvers."""

from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import supple as sp
from supple.model.state import State, Status, StepReport
from supple.results.recording.reader import Recording, read_recording
from supple.results.recording.recorder import Recorder
from supple.simulate import simulate
from supple.solvers.implicit.details import ImplicitDetails
from supple.solvers.solver import Solver


@dataclass(frozen=True)
class Prescribed(Solver):
    """Every body is stretched and compressed along y: positions are known in closed form."""

    stop_at: int = -1
    message: str = ""

    def prepare(self, system):
        return system.rest_positions.copy()

    def step(self, system, state, dt, workspace):
        time = state.time + dt
        x = path_of(state.positions, state.time, time)
        number = round(time / dt)
        status = Status.BLOCKED if number == self.stop_at else Status.CONVERGED
        details = ImplicitDetails(
            contacts=number,
            dhat=1e-3 if number % 2 else None,
            contact_forces={name: np.array([number, 0.5, -1.0]) for name in ("cube", "slab")} if number % 3 else {},
            seconds={"contact": 0.25 * number, "other": 0.1},
        )
        report = StepReport(status, number, self.message, 0.25 * number, details)
        return State(time, x, (x - state.positions) / dt), report

    def initial_details(self, system, workspace):
        zero = np.zeros(3)
        return ImplicitDetails(contact_forces={"cube": zero, "slab": zero}, seconds={"contact": 0.0, "other": 0.0})


def path_of(x: np.ndarray, before: float, after: float) -> np.ndarray:
    """Positions at time `after` of the points that are at x at time `before`."""
    stretch = (1.0 + 0.3 * np.sin(4.0 * after)) / (1.0 + 0.3 * np.sin(4.0 * before))
    return x * [1.0, stretch, 1.0]


def box(size=(1.0, 1.0, 1.0), divisions=2) -> sp.TetMesh:
    """A box of Kuhn tets, six to a cell, with its lowest corner at the origin."""
    k = divisions + 1
    grid = np.stack(np.meshgrid(*[np.linspace(0.0, s, k) for s in size], indexing="ij"), axis=-1).reshape(-1, 3)
    cells = np.stack(np.meshgrid(*[np.arange(divisions)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    paths = [(0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)]
    stride = np.array([k * k, k, 1])
    tets = []
    for path in paths:
        corner = cells @ stride
        steps = [corner]
        for axis in path:
            corner = corner + stride[axis]
            steps.append(corner)
        tets.append(np.stack(steps, axis=1))
    return sp.TetMesh(grid, np.concatenate(tets))


def octahedron(radius: float, center) -> sp.SurfaceMesh:
    vertices = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]) * radius + center
    faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    return sp.SurfaceMesh(vertices, faces)


def small_scene(divisions: int = 2, material=None) -> sp.Scene:
    """Two boxes, one with a skin, and every kind of obstacle."""
    material = material or sp.StableNeoHookean(youngs=1e4, poisson=0.4, density=1000.0)
    skin = octahedron(0.45, (0.5, 0.5, 0.5))
    return sp.Scene(
        bodies=[
            sp.Body("cube", box(divisions=divisions), material, position=(0.0, 1.0, 0.0), skin=skin),
            sp.Body("slab", box((1.0, 0.3, 1.0), divisions), material, position=(1.5, 0.5, 0.0)),
        ],
        obstacles=[
            sp.HalfSpace(),
            sp.obstacles.Sphere(center=(0.5, 0.3, 2.0), radius=0.3),
            sp.obstacles.Box(
                center=(-1.0, 0.5, 0.0),
                size=(0.5, 1.0, 0.5),
                motion=sp.Keyframes(times=[0.0, 1.0], displacements=[[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
            ),
            sp.obstacles.TriangleObstacle(surface=octahedron(0.2, (2.0, 2.0, 0.5))),
        ],
    )


def record(path: Path, steps: int = 8, *, moved_by: Solver | None = None, divisions: int = 2, **options) -> list:
    """Record the small scene; returns the simulated frames, without the start."""
    sinks = [Recorder(path, **options)]
    return list(simulate(small_scene(divisions), moved_by or Prescribed(), 1 / 30, steps, sinks=sinks))


def vtk_arrays() -> tuple[Any, Any]:
    """VTK, and its function that gives an array of NumPy; without VTK, the test is skipped."""
    vtk = pytest.importorskip("vtk")
    from vtk.util.numpy_support import vtk_to_numpy

    return vtk, vtk_to_numpy


@pytest.fixture(scope="session")
def tools() -> SimpleNamespace:
    """The names above: tests cannot import this file."""
    return SimpleNamespace(
        Prescribed=Prescribed,
        box=box,
        octahedron=octahedron,
        small_scene=small_scene,
        record=record,
        vtk=vtk_arrays,
    )


@pytest.fixture(scope="session")
def recorded(tmp_path_factory) -> tuple[Path, list]:
    """A recording of 24 steps, which tests must not change, and the frames in it."""
    path = tmp_path_factory.mktemp("recorded") / "recording.vtkhdf"
    return path, record(path, 24, scene_text="bodies: []\n", solver="Prescribed()")


@pytest.fixture
def recording(recorded) -> Recording:
    with read_recording(recorded[0]) as opened:
        yield opened
