"""The automatic number of substeps: what it follows from, repetitions, and that a step remains a pure function."""

from itertools import pairwise

import numpy as np
import pytest

import supple as sp
from supple.errors import SolverError
from supple.model.state import State
from supple.model.system import build_system, initial_state
from supple.solvers.xpbd.solver import XPBD

DT = 1.0 / 60.0
CUBE = sp.shapes.box((0.1, 0.1, 0.1), (3, 3, 3))


def cube(youngs=1e4, speed=0.0, height=0.06):
    material = sp.StableNeoHookean(youngs=youngs, poisson=0.4, density=1000)
    body = sp.Body("cube", CUBE, material, position=(0, height, 0), velocity=(0, -speed, 0))
    return sp.Scene([body], [sp.HalfSpace()])


def first(scene, **parameters):
    return next(sp.simulate(scene, XPBD(**parameters), DT, 1)).report


def test_stiff_bodies_and_short_accuracies_need_more_substeps():
    soft, stiff = (first(cube(youngs)).details for youngs in (1e5, 4e5))
    assert stiff.substeps == pytest.approx(2 * soft.substeps, abs=2)
    assert stiff.substeps_reason == "the stiffness of body 'cube'"
    assert first(cube(1e5), accuracy=0.005).details.substeps == pytest.approx(2 * soft.substeps, abs=2)


def test_fast_bodies_need_more_substeps_only_where_there_is_something_to_touch():
    details = first(cube(1e3, speed=30.0, height=2.0)).details
    assert details.substeps_reason == "the speed of approach"
    heights = 0.1 / 3 / np.sqrt(2)
    assert details.substeps == pytest.approx(30.2 * DT / (0.5 * heights), rel=0.05)
    alone = sp.Scene([cube(1e3, speed=30.0).bodies[0]])
    assert first(alone).details.substeps == 10
    moving = sp.HalfSpace(motion=sp.Keyframes(times=[0, 1], displacements=[[0, 0, 0], [0, 30, 0]]))
    assert first(sp.Scene([cube(1e3, height=2.0).bodies[0]], [moving])).details.substeps == details.substeps


def test_two_bodies_that_approach_each_other_need_more_substeps():
    bodies = [
        sp.Body(name, CUBE, sp.StableNeoHookean(youngs=1e3, poisson=0.4), position=(x, 0, 0), velocity=(v, 0, 0))
        for name, x, v in (("a", -1, 25), ("b", 1, -25))
    ]
    assert first(sp.Scene(bodies)).details.substeps > 50
    assert first(sp.Scene(bodies), contact=None).details.substeps == 10


def test_beyond_the_largest_number_a_body_is_softened_and_the_message_says_what_helps():
    report = first(cube(1e7), max_substeps=50)
    assert (report.status, report.iterations) == ("softened", 50)
    assert report.details.substeps_reason.startswith("max_substeps; the stiffness of body 'cube' needs ")
    assert f"; take max_substeps={report.details.substeps_reason.split()[-1]}" in report.message


def test_the_remedy_for_a_body_that_hardly_deforms_is_no_enormous_number_of_substeps():
    report = first(cube(1e12), max_substeps=20)
    assert report.status == "softened"
    assert "take Implicit, or a RigidBody for a body that hardly deforms (max_substeps=" in report.message


def hit(youngs=2e5, accuracy=0.5):
    """A body that is allowed to be far too soft, so that its impact has to be repeated."""
    scene = cube(youngs, speed=2.0, height=0.07)
    return list(sp.simulate(scene, XPBD(accuracy=accuracy), DT, 12))


def test_a_bad_frame_is_repeated_with_more_substeps_and_counted():
    frames = hit()
    repeated = [frame for frame in frames if frame.report.details.repeats]
    assert repeated
    for frame in repeated:
        details = frame.report.details
        assert 1 <= details.repeats <= 2
        assert details.substeps_reason.startswith("a repetition: ")
        after = frames[frame.index].report.details if frame.index < len(frames) else None
        # The next frame starts near the number that was good, and falls back from there.
        good = frame.report.status == "converged" and not details.truncated
        assert after is None or not good or after.substeps >= int(0.8 * details.substeps)
    energies = [f.report.kinetic_energy + f.report.elastic_energy + f.report.potential_energy for f in frames]
    assert max(energies) < 1.02 * energies[0]


def test_a_step_depends_on_the_state_only():
    scene = cube(2e5, speed=2.0, height=0.07)
    system, solver = build_system(scene), XPBD(accuracy=0.5)
    used, states = solver.prepare(system), [initial_state(scene)]
    for _ in range(6):
        states.append(solver.step(system, states[-1], DT, used)[0])
    for before, after in pairwise(states):
        again, _ = solver.step(system, before, DT, solver.prepare(system))
        np.testing.assert_array_equal(again.positions, after.positions)
        np.testing.assert_array_equal(again.velocities, after.velocities)


def test_a_state_without_memory_can_be_continued():
    frame = hit()[3]
    state = State(frame.time, frame.state.positions, frame.state.velocities)
    assert next(sp.simulate(frame.system.scene, XPBD(), DT, 1, start=state)).report.status == "converged"


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"substeps": "many"}, "substeps is 'many'; give a whole number of one or more, or 'auto'"),
        ({"max_substeps": 0}, "max_substeps is 0"),
        ({"accuracy": 0.0}, "accuracy is 0; it must be above zero and below 1"),
        ({"accuracy": True}, "accuracy is True"),
    ],
)
def test_wrong_parameters_are_errors(parameters, message):
    with pytest.raises(SolverError, match=message):
        XPBD(**parameters)
