"""Scenes that users meet first: their kernels are listed, compiled by `supple warm`, and packed into wheels."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import supple as sp
from supple.app.demos.registry import find_demo
from supple.solvers.solver import Solver


def _ball(solver: Solver) -> Callable[[], None]:
    """The scene of README's snippet."""

    def run() -> None:
        body = sp.Body(
            "ball",
            sp.shapes.sphere(radius=0.5, edge_length=0.2),
            sp.StableNeoHookean(youngs=5e4, poisson=0.45, density=1000),
            position=(0, 1, 0),
        )
        floor = sp.HalfSpace(point=(0, 0, 0), normal=(0, 1, 0), friction=0.5)
        for frame in sp.simulate(sp.Scene(bodies=[body], obstacles=[floor]), solver, dt=1 / 60, steps=60):
            _ = frame.report

    return run


def _demo(name: str) -> Callable[[], None]:
    """The first second of a demo; what it needs later is compiled then."""

    def run() -> None:
        demo = find_demo(name)
        measurement = demo.measurement()
        with TemporaryDirectory() as folder:
            recorder = sp.Recorder(Path(folder) / "recording.vtkhdf")
            for frame in sp.simulate(
                demo.scene(), demo.solver(), demo.dt, round(1.0 / demo.dt), sinks=[measurement, recorder]
            ):
                _ = frame.report
            measurement.claims()

    return run


def _tutorial() -> None:
    """The scenes of docs/tutorial.md, shorter."""
    surface = sp.shapes.gummy_bear_surface(height=0.1, resolution=16)
    surface.check()
    jelly = sp.StableNeoHookean(youngs=2e4, poisson=0.45, density=1100)
    bear = sp.Body("bear", sp.tetrahedralize(surface, max_volume=1e-6), jelly, position=(0, 0.06, 0))
    floor = sp.HalfSpace(friction=0.5, name="floor")
    solvers: tuple[Solver, ...] = (sp.XPBD(), sp.Implicit())
    for solver in solvers:
        with TemporaryDirectory() as folder:
            path = Path(folder) / "recording.vtkhdf"
            _run(sp.Scene([bear], obstacles=[floor]), solver, 15, [sp.Recorder(path)])
            sp.check_recording(path)
    for solver in solvers:
        soft = sp.StableNeoHookean(youngs=2e4, poisson=0.3, damping=0.02)
        mat = sp.Body("mat", sp.shapes.box((0.1, 0.04, 0.1), (5, 2, 5)), soft)
        _run(sp.Scene([mat], pins=[sp.Pin("mat", sp.InBox((-1, -1, -1), (1, -0.0199, 1)))]), solver, 5)
    firm = sp.StableNeoHookean(youngs=5e4, poisson=0.4, density=1100, damping=0.02)
    block = sp.Body("block", sp.shapes.box((0.1, 0.1, 0.1), (2, 2, 2)), firm, position=(0, 0.0505, 0))
    _run(sp.Scene([block], obstacles=[floor]), sp.Implicit(), 10)
    hat = sp.Body("hat", sp.shapes.box((0.06, 0.02, 0.06), (3, 1, 3)), firm, position=(0, 0.112, 0))
    stitch = sp.SoftVertexTriangleStitch("hat", "block", max_distance=0.005, youngs=2e4, poisson=0.4)
    _run(sp.Scene([block, hat], obstacles=[floor], stitches=[stitch]), sp.XPBD(), 10)


def _run(scene: sp.Scene, solver: Solver, steps: int, sinks: list[sp.Recorder] | None = None) -> None:
    for frame in sp.simulate(scene, solver, dt=1 / 60, steps=steps, sinks=sinks or []):
        _ = frame.report


STANDARD_SCENES: dict[str, Callable[[], None]] = {
    "ball": _ball(sp.XPBD(substeps=20)),
    "implicit": _ball(sp.Implicit()),
    "squash": _demo("squash"),
    "bears": _demo("bears"),
    "tutorial": _tutorial,
}
