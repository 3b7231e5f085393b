"""The default dhat: from gaps where a simulation begins, and not where the scene places its bodies."""

import numpy as np
import pytest

import supple as sp
from supple.model.system import initial_state
from supple.simulate import first_frame

LARGEST = 1e-3 * 0.2 * np.sqrt(3)


def scene(gap):
    """A cube of 20 cm that the scene places `gap` above the floor."""
    rubber = sp.StableNeoHookean(youngs=1e5, poisson=0.3, density=1000.0)
    cube = sp.Body("cube", sp.shapes.box((0.2,) * 3, (1, 1, 1)), rubber, position=(0, 0.1 + gap, 0))
    return sp.Scene([cube], [sp.HalfSpace()])


def dhat_of(scene, start):
    return sp.Implicit().prepare(first_frame(scene, start).system).contact.scales.dhat


def moved_up(scene, height):
    placed = initial_state(scene).positions
    return initial_state(scene, {"cube": placed + np.array([0, height, 0])})


@pytest.mark.parametrize(("placed", "begins"), [(3e-6, 0.5), (0.5, 1e-4), (1e-4, 2e-4)])
def test_dhat_follows_initial_positions(placed, begins):
    one = scene(placed)
    assert dhat_of(one, moved_up(one, begins - placed)) == pytest.approx(min(LARGEST, begins), rel=1e-6)


@pytest.mark.parametrize("as_frame", [True, False])
def test_dhat_is_not_too_small_where_a_simulation_is_continued_farther_away(as_frame):
    one = scene(3e-6)
    assert dhat_of(one, initial_state(one)) == pytest.approx(3.464e-6, rel=1e-3)  # 1e-5 of the diagonal at least
    thrown = initial_state(one, None, {"cube": np.tile([0.0, 3.0, 0.0], (8, 1))})
    frame = list(sp.simulate(one, sp.XPBD(), 1 / 60, 6, start=thrown))[-1]
    assert dhat_of(one, frame if as_frame else frame.state) == pytest.approx(LARGEST, rel=1e-6)


def test_a_run_that_is_continued_at_rest_keeps_its_dhat():
    one = scene(1e-4)
    frames = list(sp.simulate(one, sp.Implicit(), 1 / 60, 6))
    used = frames[-1].report.details.dhat
    assert used == pytest.approx(1e-4, rel=1e-6)
    assert frames[-1].report.min_distance < used
    for start in (frames[-1], frames[-1].state):
        assert dhat_of(one, start) == used
