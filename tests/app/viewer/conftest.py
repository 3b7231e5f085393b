"""Small scenes for the live page."""

from dataclasses import replace

import numpy as np
import pytest

import supple as sp
from supple.app.viewer.engine.scene.live_scene import LiveScene
from supple.app.viewer.engine.simulation_loop import SimulationLoop
from supple.app.viewer.protocol.commands import Grab
from supple.app.viewer.protocol.live_source import LiveSource


def small_source(**changes):
    """A rubber cube that falls on a floor, and a block whose left end is pinned."""
    rubber = sp.StableNeoHookean(youngs=1e5, poisson=0.4, density=1000.0)
    cube = sp.Body("cube", sp.shapes.box((0.4, 0.4, 0.4), (3, 3, 3)), rubber, position=(0.0, 0.5, 0.0))
    block = sp.Body("block", sp.shapes.box((0.6, 0.2, 0.2), (4, 2, 2)), rubber, position=(1.5, 1.0, 0.0))
    left = sp.InBox((1.0, 0.0, -1.0), (1.21, 2.0, 1.0))
    parts = {
        "bodies": [cube, block],
        "obstacles": [sp.HalfSpace(name="floor")],
        "pins": [sp.Pin("block", left)],
        **changes,
    }
    return LiveSource("small", sp.Scene(**parts), sp.XPBD(substeps=8), 1 / 60)


def free_source(**changes):
    """One rubber cube in free space."""
    rubber = sp.StableNeoHookean(youngs=1e5, poisson=0.4, density=1000.0, damping=0.01)
    cube = sp.Body("cube", sp.shapes.box((0.4, 0.4, 0.4), (3, 3, 3)), rubber)
    return LiveSource("free", sp.Scene([cube], gravity=(0, 0, 0), **changes), sp.XPBD(substeps=8), 1 / 60)


def run(live, steps):
    for _ in range(steps):
        assert live.step().status.can_go_on


def squash(live, factor):
    """Scale the height of what is not pinned along gravity; it gets wider, keeps its volume, and starts at rest."""
    x, v = live.state.positions.copy(), live.state.velocities.copy()
    pinned = live.system.pinned_vertices
    for part in live.system.bodies:
        if not np.isin(pinned, np.arange(part.vertices.start, part.vertices.stop)).any():
            own = x[part.vertices]
            heights = own @ live.up
            flat = own - heights[:, None] * live.up
            middle, low = flat.mean(axis=0), heights.min()
            height = low + factor * (heights - low)
            x[part.vertices] = middle + (flat - middle) / np.sqrt(factor) + height[:, None] * live.up
            v[part.vertices] = 0.0
    live.adopt_checked(live.setup, replace(live.state, positions=x, velocities=v, memory=None))


def corner_grab(target, **more):
    return Grab(7, "cube", (0,), (1.0,), target, **more)


@pytest.fixture
def live():
    return LiveScene(small_source())


class Collected:
    """An outbox that stores what it gets."""

    def __init__(self):
        self.descriptions, self.snapshots, self.progress = [], [], []

    def put_description(self, description):
        self.descriptions.append(description)

    def put_snapshot(self, snapshot):
        self.snapshots.append(snapshot)

    def put_progress(self, progress):
        self.progress.append(progress)


@pytest.fixture
def loop(live):
    """A loop without processes: `execute` runs commands, `snapshot` returns snapshots."""
    from supple.app.viewer.protocol.command_queue import CommandQueue

    return SimulationLoop(live, CommandQueue(), Collected())
