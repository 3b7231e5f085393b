"""Small scenes in which a solver needs all of its memory: contact, friction, stitches, damping and scripts."""

from dataclasses import dataclass

import numpy as np
import pytest

import supple as sp
from supple.model.state import State, Status, StepReport
from supple.scene.scene import Scene
from supple.solvers.solver import Solver

DT, STEPS = 1 / 60, 16
MESH = sp.shapes.box((0.2, 0.2, 0.2), (1, 1, 1))
SOFT = sp.StableNeoHookean(youngs=5e4, poisson=0.4, damping=0.01)


@dataclass(frozen=True)
class Drift(Solver):
    """Moves everything by its velocity; stops with `status` at the step `stops_at` after time 0."""

    stops_at: int = -1
    status: Status = Status.NOT_FINITE

    def prepare(self, system):
        return None

    def step(self, system, state, dt, workspace):
        if round(state.time / dt) + 1 == self.stops_at:
            return state, StepReport(self.status, 1, "vertex 2 left for infinity")
        x = state.positions + dt * state.velocities
        return State(state.time + dt, x, state.velocities), StepReport(Status.CONVERGED, 1)


def circling(time: float) -> tuple[float, float, float]:
    return (0.05 * np.sin(9 * time), 0.0, 0.02 * time)


def contact_scene() -> Scene:
    """Two cubes that slide and jump on a floor, one on the other."""
    low = sp.Body("low", MESH, SOFT, position=(0, 0.102, 0), velocity=(0.5, 0.9, 0), friction=0.3)
    high = sp.Body("high", MESH, SOFT, position=(0.03, 0.305, 0.01), velocity=(0, 0, 0.3), friction=0.3)
    return sp.Scene([low, high], obstacles=[sp.HalfSpace(friction=0.4, name="floor")])


def stitched_scene() -> Scene:
    """Two cubes stitched together over a floor; one is pinned to a script, and a force pulls at the other."""
    one = sp.Body("one", MESH, SOFT, position=(0, 0.25, 0))
    two = sp.Body("two", MESH, SOFT, position=(0.21, 0.25, 0), friction=0.3)
    stitch = sp.SoftVertexTriangleStitch("one", "two", max_distance=0.02, youngs=1e5, poisson=0.4, damping=0.01)
    return sp.Scene(
        [one, two],
        obstacles=[sp.HalfSpace(friction=0.4, name="floor")],
        pins=[sp.Pin("one", [0, 1], circling)],
        stitches=[stitch],
        forces=[sp.Force("two", [6, 7], lambda time: (0, -40 * time, 0))],
        soft_targets=[sp.SoftTarget("two", [5], 50.0, sp.Keyframes([0, 1], displacements=[(0, 0, 0), (1, 0, 0)]))],
    )


def drifting_scene(velocity: float = 1.0) -> Scene:
    return sp.Scene([sp.Body("cube", MESH, SOFT, velocity=(velocity, 0, 0))], gravity=(0, 0, 0))


def same_bits(one, other) -> bool:
    return (
        one.time == other.time
        and one.state.positions.tobytes() == other.state.positions.tobytes()
        and one.state.velocities.tobytes() == other.state.velocities.tobytes()
    )


def kept(folder, scene, solver, stop_after=None, steps=STEPS, **options):
    """Run into a folder, and stop after some frames."""
    frames = sp.simulate(scene, solver, DT, steps, sinks=[sp.RunFolder(folder, solver, **options)])
    seen = []
    for frame in frames:
        seen.append(frame)
        if len(seen) == stop_after:
            frames.close()
    return seen


@pytest.fixture
def out(tmp_path):
    return tmp_path / "out"
