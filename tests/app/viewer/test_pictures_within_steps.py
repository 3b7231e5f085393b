"""Steps that take long are drawn while they run; this changes nothing of what they compute."""

import dataclasses

import numpy as np
import pytest

import supple as sp
from supple.app.viewer.engine import simulation_loop
from supple.app.viewer.engine.scene.live_scene import LiveScene
from supple.app.viewer.engine.simulation_loop import SimulationLoop
from supple.app.viewer.protocol import commands
from supple.app.viewer.protocol.command_queue import CommandQueue
from supple.app.viewer.protocol.live_source import LiveSource

from .conftest import Collected, corner_grab, small_source


@pytest.fixture
def eager(loop, monkeypatch):
    """A playing loop for which every substep comes late."""
    monkeypatch.setattr(simulation_loop, "LONGEST_UNSEEN", 0.0)
    loop.execute(commands.Play())
    loop.publish(0.0)
    loop.outbox.snapshots.clear()
    return loop


def test_each_substep_of_a_long_step_is_drawn(eager):
    begun = eager.live.state
    eager.step()
    times = [picture.time for picture in eager.outbox.snapshots]
    # The eighth substep ends with the step.
    assert times == pytest.approx([k / 8 / 60 for k in range(1, 8)])
    pictures = [begun, *eager.outbox.snapshots, eager.live.state]
    falls = np.diff([picture.positions[:64, 1].mean() for picture in pictures])
    # Semi-implicit Euler: h^2 g more with every substep.
    assert falls == pytest.approx(-9.81 * np.arange(1, 9) / (8 * 60) ** 2, rel=1e-6)


def test_pictures_do_not_change_the_bits(eager):
    plain = LiveScene(small_source())
    grab = corner_grab((0.4, 1.0, 0.2))
    for live in (eager.live, plain):
        simulation_loop.change(grab, live)
    for _ in range(5):
        eager.step()
        plain.step()
    assert len(eager.outbox.snapshots) > 30
    assert np.array_equal(eager.live.state.positions, plain.state.positions)
    assert np.array_equal(eager.live.state.velocities, plain.state.velocities)


def test_a_picture_within_a_step_shows_what_has_moved_by_then(eager):
    eager.execute(corner_grab((0.4, 1.0, 0.2)))
    eager.inbox.put(9, commands.MoveGrab(7, (0.5, 1.1, 0.2)))
    eager.step()
    pictures = eager.outbox.snapshots
    heights = [picture.positions[-1, 1] for picture in pictures]
    assert np.all(np.diff(heights) < 0.0)
    for picture in pictures:
        assert (picture.grabs[0].target, picture.applied) == ((0.5, 1.1, 0.2), 9)
        assert picture.grabs[0].point == pytest.approx(picture.positions[0])


@pytest.mark.parametrize("command", [commands.Pause(), commands.SetSpeed(0.1), commands.Watch(False)])
def test_no_picture_within_a_step_that_is_paused_slow_or_unwatched(eager, command):
    eager.execute(command)
    eager.step()
    assert not eager.outbox.snapshots


def test_quick_steps_are_drawn_at_their_end_only(loop, monkeypatch):
    monkeypatch.setattr(simulation_loop, "LONGEST_UNSEEN", 1e9)
    loop.execute(commands.Play())
    loop.publish(0.0)
    loop.step()
    assert len(loop.outbox.snapshots) == 1


class Repeating(sp.XPBD):
    """Takes every step twice, as automatic substeps do where a frame turns out bad."""

    def step(self, system, state, dt, workspace):
        super().step(system, state, dt, workspace)
        return super().step(system, state, dt, workspace)


def test_a_repeated_frame_is_not_drawn_backwards(eager):
    eager.live.adopt(dataclasses.replace(eager.live.setup, solver=Repeating(substeps=8)))
    eager.publish(0.0)
    eager.outbox.snapshots.clear()
    for _ in range(2):
        eager.step()
        eager.publish(0.0)
    times = [picture.time for picture in eager.outbox.snapshots]
    assert times == pytest.approx([k / 8 / 60 for k in range(1, 17)])


def test_a_solver_without_substeps_is_drawn_at_the_end_of_a_step(monkeypatch):
    monkeypatch.setattr(simulation_loop, "LONGEST_UNSEEN", 0.0)
    loop = SimulationLoop(LiveScene(small_source()), CommandQueue(), Collected())
    loop.execute(commands.SetSolver("implicit"))
    loop.execute(commands.Play())
    loop.publish(0.0)
    loop.step()
    assert loop.live.report.status == "converged"
    assert len(loop.outbox.snapshots) == 1


def test_the_present_state_of_xpbd_is_that_of_the_frame_at_its_end():
    """Also of soft and rigid bodies that are welded, whose control points the solver moves."""
    beam = sp.shapes.box((0.4, 0.1, 0.1), (4, 1, 1))
    soft = sp.Body("beam", beam, sp.StableNeoHookean(youngs=2e5, poisson=0.3, density=1000.0))
    cube = sp.RigidBody("cube", sp.shapes.box_surface((0.1, 0.1, 0.1), (1, 1, 1)), density=1000, position=(-0.25, 0, 0))
    weld = sp.Weld("beam", "cube", np.flatnonzero(beam.vertices[:, 0] < -0.199), name="weld")
    live = LiveScene(LiveSource("welded", sp.Scene([soft, cube], welds=[weld]), sp.XPBD(substeps=8), 1 / 60))
    assert live.step().status.can_go_on
    current, end = live.workspace.present(), live.state
    assert current.time == pytest.approx(end.time)
    assert current.positions == pytest.approx(end.positions, abs=1e-12)
    assert current.velocities == pytest.approx(end.velocities, abs=1e-12)
