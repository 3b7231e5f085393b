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


STANDARD_SCENES: dict[str, Callable[[], None]] = {
    "ball": _ball(sp.XPBD(substeps=20)),
    "implicit": _ball(sp.Implicit()),
    "squash": _demo("squash"),
    "bears": _demo("bears"),
}
