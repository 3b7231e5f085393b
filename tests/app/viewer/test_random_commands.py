"""The simulation loop without its process survives random commands, with valid and with hostile values."""

import dataclasses
import math
import random

import numpy as np
import pytest

import supple as sp
from supple.app.viewer.engine.scene.live_scene import LiveScene
from supple.app.viewer.engine.simulation_loop import SimulationLoop
from supple.app.viewer.protocol import commands
from supple.app.viewer.protocol.command_queue import CommandQueue
from supple.app.viewer.protocol.live_source import LiveSource
from supple.app.viewer.protocol.parameters import PARAMETERS
from supple.errors import CommandError
from supple.model.state import Status

from .conftest import Collected

HOSTILE = [
    math.nan,
    math.inf,
    -math.inf,
    10**400,
    -1,
    1e308,
    "x" * 10_000,
    None,
    [],
    {},
    b"\0",
    True,
    "../../etc",
    2**63,
]


def random_command(rng, bodies, solvers=("xpbd",)):
    """A command of any kind, with valid or hostile values; None where it is refused."""
    body = rng.choice([*bodies, "ghost"])
    point = tuple(rng.choice([rng.uniform(-2, 2), rng.uniform(-1e4, 1e4)]) for _ in range(3))
    parameter = rng.choice(list(PARAMETERS.values()))
    value = rng.uniform(parameter.low, min(parameter.high, 1e6))
    value = {bool: rng.random() < 0.5, int: min(round(value), 12), float: value}[parameter.kind]
    owner = body if parameter.owner == "body" else None
    made = rng.choice(
        [
            lambda: commands.Play(),
            lambda: commands.Pause(),
            lambda: commands.Step(rng.randint(1, 3)),
            lambda: commands.Reset(),
            lambda: commands.SetSpeed(rng.uniform(0.01, 1.0)),
            lambda: commands.SetSolver(rng.choice(solvers)),
            lambda: commands.SetParameter(parameter.name, value, rng.choice([None, owner])),
            lambda: commands.SetView(rng.choice([None, "J", "von_mises", "energy"]), rng.random() < 0.5),
            lambda: commands.Grab(
                rng.randint(0, 20), body, (rng.randint(0, 80),), (1.0,), point, 10 ** rng.uniform(-2, 2)
            ),
            lambda: commands.MoveGrab(rng.randint(0, 20), point),
            lambda: commands.ReleaseGrab(rng.randint(0, 20)),
            lambda: commands.Pin(body, rng.randint(0, 80)),
            lambda: commands.Unpin(body, rng.randint(0, 80)),
            lambda: commands.Unpin(),
        ]
    )
    if rng.random() < 0.2:  # make one value invalid
        good = made()
        names = [field.name for field in dataclasses.fields(good)]
        if not names:
            return good
        changed = {name: getattr(good, name) for name in names} | {rng.choice(names): rng.choice(HOSTILE)}
        try:
            return type(good)(**changed)
        except CommandError:
            return None
    return made()


@pytest.mark.parametrize("count", [100, pytest.param(1000, marks=pytest.mark.slow)])
def test_random_commands_leave_a_finite_state(count, loop, caplog):
    rng = random.Random(20240229)
    refused = run_random_commands(loop, rng, count, ["xpbd"])
    assert refused > count / 20
    assert loop.live.revision > count / 50
    # Only unexpected exceptions are logged.
    assert [record.message for record in caplog.records if record.levelname == "ERROR"] == []
    assert loop.snapshot(0.0).measures.status in set(Status)


def test_random_commands_to_the_implicit_solver_leave_a_finite_state(caplog):
    rubber = sp.StableNeoHookean(youngs=1e5, poisson=0.3)
    cube = sp.Body("cube", sp.shapes.box((0.4, 0.4, 0.4), (2, 2, 2)), rubber, position=(0, 0.3, 0))
    source = LiveSource("cube", sp.Scene([cube], [sp.HalfSpace()]), sp.Implicit(max_substeps=4), 1 / 60)
    loop = SimulationLoop(LiveScene(source), CommandQueue(), Collected())
    loop.watch.longest = 0.2
    run_random_commands(loop, random.Random(5), 80, ["xpbd", "implicit"])
    assert [record.message for record in caplog.records if record.levelname == "ERROR"] == []


def run_random_commands(loop, rng, count, solvers):
    """Send random commands to a loop, one in each run. Returns how many were refused."""
    refused = 0
    for number in range(count):
        bodies = [part.name for part in loop.live.system.bodies]
        command = random_command(rng, bodies, solvers)
        if command is None:
            refused += 1
        else:
            loop.inbox.put(number, command)
        loop.pacing.due = 0.0  # do not wait for the clock
        loop.run_once(0.0)
        state = loop.live.state
        assert np.isfinite(state.positions).all()
        assert np.isfinite(state.velocities).all()
    return refused
