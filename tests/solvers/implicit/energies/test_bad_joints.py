"""Joints and starts that are refused, in one line each."""

import numpy as np
import pytest
from tests.scenes import bar, hinge

import supple as sp

SOFT = sp.Body("soft", sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1)), sp.StableNeoHookean(youngs=1e5, poisson=0.3))


@pytest.mark.parametrize(
    ("make", "problem"),
    [
        (lambda: hinge(second="bar"), "joint 'hinge': it joins body 'bar' to itself"),
        (lambda: hinge(axis=(0, 0, 0)), "joint 'hinge': axis has no length"),
        (lambda: hinge(limits=(1, -1)), "limits are (1, -1), and the first is not below the second"),
        (lambda: hinge(limits=3), "give two numbers (low, high)"),
        (lambda: hinge(motor=3.0), "motor is 3.0; give PositionMotor"),
        (lambda: sp.BallJoint("bar"), "point is missing"),
        (lambda: sp.BallJoint("bar", point=(0, 0, 0), axis=(1, 0, 0)), "a limit needs both axis and max_swing"),
        (lambda: sp.BallJoint("bar", point=(0, 0, 0), axis=(1, 0, 0), max_swing=3.2), "give one from 0.01 to 3.132"),
        (lambda: sp.BallJoint("bar", point=(0, 0, 0), twist_limits=(-1, 1)), "twist_limits need axis and max_swing"),
        (
            lambda: sp.BallJoint("bar", point=(0, 0, 0), axis=(1, 0, 0), max_swing=1, twist_limits=(-4, 1)),
            "twist_limits are (-4, 1); give two from -3.132 to 3.132",
        ),
        (lambda: hinge(max_velocity=0.0), "max_velocity"),
        (lambda: sp.BallJoint("bar", point=(0, 0)), "point has shape (2,)"),
        (lambda: sp.PositionMotor(1.0, stiffness=0.0), "stiffness and damping are both zero"),
        (lambda: sp.PositionMotor(1.0, stiffness=-1.0), "PositionMotor: stiffness is -1"),
        (lambda: sp.VelocityMotor(1.0, max_force=0.0), "VelocityMotor: max_force is 0; it must be above zero"),
        (lambda: hinge(damping=-1.0), "joint 'hinge': damping is -1"),
        (lambda: hinge(max_effort=0.0), "joint 'hinge': max_effort is 0; it must be above zero"),
        (lambda: sp.ForceMotor((1, 2, 3)), "ForceMotor: force has shape (3,)"),
        (lambda: sp.Scene([bar()], joints=[hinge("bat")]), "body 'bat' does not exist; did you mean 'bar'?"),
        (lambda: sp.Scene([bar()], joints=[hinge(second="x")]), "body or obstacle 'x' does not exist"),
        (lambda: sp.Scene([SOFT], joints=[hinge("soft")]), "body 'soft' is soft; joints join rigid bodies"),
        (lambda: sp.Scene([bar()], joints=[hinge(), hinge()]), "another joint has this name"),
    ],
)
def test_bad_joints_are_refused_in_one_line(make, problem):
    with pytest.raises(sp.SceneError) as error:
        make()
    assert problem in str(error.value)


@pytest.mark.parametrize("length", [1e-310, 1e-200, 3.0, 1e200, 1e308])
def test_an_axis_has_any_length(length):
    for joint in (
        hinge(axis=(0, length, length)),
        sp.BallJoint("bar", point=(0, 0, 0), axis=(0, length, length), max_swing=1),
    ):
        np.testing.assert_allclose(joint.axis, [0, 0.5**0.5, 0.5**0.5], rtol=1e-14)
    muscle = sp.Muscle("soft", 1e3, (0, length, length))
    np.testing.assert_allclose(muscle.direction, [0, 0.5**0.5, 0.5**0.5], rtol=1e-14)


@pytest.mark.parametrize(
    ("joints", "integrator", "problem"),
    [
        ([hinge(motor=sp.VelocityMotor(1.0))], "static", "nothing moves, and its motor has a velocity"),
        ([hinge(limits=(0.5, 1.0))], "bdf2", "at the start it is at 0 rad, outside of its limits (0.5, 1)"),
    ],
)
def test_starts_without_sense_are_refused_in_one_line(joints, integrator, problem):
    with pytest.raises((sp.SceneError, sp.SolverError)) as error:
        sp.simulate(sp.Scene([bar()], joints=joints), sp.Implicit(integrator=integrator), 0.01, 1)
    assert problem in str(error.value)


def test_a_start_at_which_the_sides_are_apart_is_refused():
    body = bar()
    moved = {"bar": body.points + np.array([0.6, 0.0, 0.0])}
    with pytest.raises(sp.SceneError, match=r"joint 'hinge': at the start it is off by 0.1 m"):
        sp.simulate(sp.Scene([body], joints=[hinge()]), sp.Implicit(), 0.01, 1, initial_positions=moved)


def test_joints_that_contradict_each_other_are_named():
    """A pin moves the body away from its hinge."""
    scene = sp.Scene([bar()], joints=[hinge()], pins=[sp.Pin("bar", motion=lambda t: (t, 0, 0))])
    with_hinge = list(sp.simulate(scene, sp.Implicit(contact=None, max_substeps=1), 0.01, 1))[-1].report
    assert with_hinge.status == "iteration_limit"
    assert with_hinge.message.startswith("joint 'hinge' is off by 1.00e-02 m: a pin")
