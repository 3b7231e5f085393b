"""A reset keeps what the solver computed once, as long as the scene is the same, and leads to the same bits."""

import numpy as np
import pytest

from supple.app.viewer.engine.scene.changes import change
from supple.app.viewer.engine.scene.live_scene import LiveScene
from supple.app.viewer.protocol.commands import Pin, Reset, SetParameter, Unpin
from supple.errors import SolverError
from supple.runtime.interruption import interruptible

from .conftest import corner_grab, run, small_source, squash


def state_after(live, steps):
    run(live, steps)
    return live.state


def same_bits(a, b):
    return np.array_equal(a.positions, b.positions) and np.array_equal(a.velocities, b.velocities) and a.time == b.time


def test_after_a_reset_a_scene_does_the_same_bit_for_bit(live):
    expected = state_after(LiveScene(small_source()), 12)
    workspace = live.workspace
    for disturb in (
        lambda: change(corner_grab((0.3, 1.2, 0.1)), live),
        lambda: change(Pin("cube", 3), live),
        lambda: change(Unpin(), live),
        lambda: squash(live, 0.5),
    ):
        disturb()
        run(live, 3)
        change(Reset(), live)
        assert live.workspace is workspace
        assert live.state.time == 0.0
        assert not (live.setup.grabs)
        assert not (live.setup.page_pins)
    assert same_bits(state_after(live, 12), expected)


def test_a_reset_keeps_a_changed_time_step(live):
    workspace = live.workspace
    change(SetParameter("dt", 0.01), live)
    change(Reset(), live)
    run(live, 1)
    assert live.workspace is workspace
    assert live.state.time == pytest.approx(0.01)


@pytest.mark.parametrize("command", [SetParameter("youngs", 3e5), Unpin("block", 0)])
def test_after_a_change_of_the_scene_a_reset_computes_it_again_once(live, command):
    first = live.workspace
    change(command, live)
    change(Reset(), live)
    second = live.workspace
    assert second is not first
    run(live, 2)
    change(Reset(), live)
    assert live.workspace is second


def test_a_workspace_that_was_left_in_the_middle_of_a_step_is_not_kept(live):
    expected = state_after(LiveScene(small_source()), 4)
    workspace, calls = live.workspace, []

    def stop():
        calls.append(1)
        if len(calls) == 4:
            raise SolverError("given up")

    with interruptible(stop), pytest.raises(SolverError):
        live.step()
    live.prepare_workspace()
    change(Reset(), live)
    assert live.workspace is not workspace
    assert same_bits(state_after(live, 4), expected)
