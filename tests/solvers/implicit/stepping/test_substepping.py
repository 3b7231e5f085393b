"""The substeps of a step: where scripts turn, and where substeps fail."""

import numpy as np
import pytest

import supple as sp
from supple.model.system import build_system, initial_state
from supple.solvers.implicit.stepping.substepping import Substepping


def turning_bar(turns: float, side: float = 0.1) -> sp.Scene:
    """One end of a bar of 1 m makes `turns` in one second."""
    mesh = sp.shapes.box((1.0, side, side), (8, 1, 1))
    spin = sp.Keyframes(times=[0.0, 1.0], angles=[0.0, 2 * np.pi * turns], axis=(1, 0, 0))
    return sp.Scene(
        [sp.Body("bar", mesh, sp.NeoHookean(youngs=1e5, poisson=0.4))],
        pins=[
            sp.Pin("bar", sp.InBox((-1, -1, -1), (-0.499, 1, 1)), name="wall"),
            sp.Pin("bar", sp.InBox((0.499, -1, -1), (1, 1, 1)), spin, name="hand"),
        ],
        gravity=(0, 0, 0),
    )


def substepping(turns: float, side: float = 0.1, max_substeps: int = 4, dt: float = 1.0) -> Substepping:
    scene = turning_bar(turns, side)
    return Substepping.of(build_system(scene, initial_state(scene)), 0.0, dt, 0.05, max_substeps)


def test_a_step_without_turns_is_one_piece():
    whole = substepping(0.2)
    assert (whole.length, whole.end) == (1.0, 1.0)
    whole.advance()
    assert whole.over


@pytest.mark.parametrize("side", [0.1, 1e-4])
def test_turns_are_followed_whatever_the_thickness(side: float):
    pieces = []
    step = substepping(4.0, side)
    while not step.over:
        pieces.append(step.length)
        step.advance()
    assert sum(pieces) == 1.0
    assert max(pieces) <= 1 / 8  # half a turn at most


def test_each_piece_may_be_halved_as_often():
    step = substepping(4.0, max_substeps=4)
    piece = step.length
    assert step.halve()
    assert step.halve()
    assert not step.halve()
    assert step.length == piece / 4
    step.advance()
    step.advance()
    assert step.length == piece / 2  # grows again when it can
    step.advance()
    assert step.end == 2 * piece
    assert step.length == piece
    assert step.halve()


def test_a_script_that_jumps_takes_few_pieces():
    mesh = sp.shapes.box((1, 1, 1), (1, 1, 1))
    scene = sp.Scene(
        [sp.Body("cube", mesh, sp.NeoHookean(youngs=1e5, poisson=0.4))],
        pins=[sp.Pin("cube", [0], lambda t: (0.0, 3.0 * (t > 0.3), 0.0))],
    )
    step = Substepping.of(build_system(scene, initial_state(scene)), 0.0, 1.0, 0.05, 64)
    count = 0
    while not step.over:
        count += 1
        step.advance()
    assert count < 30


def test_a_thin_rod_is_twisted_by_a_whole_turn_in_one_step():
    frame = next(iter(sp.simulate(turning_bar(1.0, 0.02), sp.Implicit(), 1.0, 1)))
    assert frame.report.status == "converged", frame.report.message
    middle = np.abs(frame.system.rest_positions[:, 0]) < 1e-6
    ends = [x[middle][:, 1:] for x in (frame.system.rest_positions, frame.state.positions)]
    before, after = [end - end.mean(axis=0) for end in ends]  # it bends sideways as well
    np.testing.assert_allclose(after, -before, atol=0.3 * 0.02)


@pytest.mark.parametrize("dt", [7.5, 3.75, 2.5])
def test_a_bar_twisted_into_itself_converges_with_the_defaults(dt: float):
    from tests.torture.twist8 import scene

    for frame in sp.simulate(scene((24, 1), 3.0), sp.Implicit(), dt, round(7.5 / dt)):
        assert frame.report.status == "converged", frame.report.message
        assert frame.det_F.min() > 0.3
    assert frame.report.min_distance is not None
    # 100 to 160 here. Where Newton's method crawled, with all terms modelled convex, a frame took a thousand and more.
    assert frame.report.iterations < 500


def test_the_message_names_the_limit_that_is_reached():
    solver = sp.Implicit(max_iterations=4, max_substeps=2)
    frame = next(iter(sp.simulate(turning_bar(0.3), solver, 1.0, 1)))
    assert frame.report.status == "iteration_limit"
    assert "max_substeps" in frame.report.message
