"""The check of what passes between the frames of a recording."""

import pytest

import supple as sp

BALL = sp.shapes.sphere(0.02, 0.012)
RUBBER = sp.StableNeoHookean(youngs=1e6, poisson=0.4, density=1000)


def verdict(path, solver, second, offset=0.003, steps=3):
    """Of a ball that flies at a thing at 20 m/s, 33 cm in a frame."""
    ball = sp.Body("ball", BALL, RUBBER, position=(-0.3, -offset, 0), velocity=(20, 0, 0))
    bodies, obstacles = ([ball, second], []) if isinstance(second, (sp.Body, sp.RigidBody)) else ([ball], [second])
    scene = sp.Scene(bodies, obstacles, gravity=(0, 0, 0))
    for _ in sp.simulate(scene, solver, dt=1 / 60, steps=steps, sinks=[sp.Recorder(path)]):
        pass
    return sp.check_recording(path, only=["tunnelling"])["tunnelling"]


def other(velocity):
    return sp.Body("other", BALL, RUBBER, position=(0.3 if velocity else 0.0, 0, 0), velocity=(velocity, 0, 0))


PLATE = sp.shapes.box_surface((0.004, 0.2, 0.2), (1, 1, 1))
BLIND = sp.Implicit(contact=None)


@pytest.mark.parametrize("velocity", [-20, 0])
def test_balls_that_fly_through_each_other_fail(tmp_path, velocity):
    found = verdict(tmp_path / "a.vtkhdf", BLIND, other(velocity))
    assert found.verdict == "fail"
    assert "ball and other, after frame" in found.message


def test_a_ball_that_flies_through_a_plate_fails(tmp_path):
    assert verdict(tmp_path / "a.vtkhdf", BLIND, sp.RigidBody("plate", PLATE, density=1000)).verdict == "fail"


@pytest.mark.parametrize("solver", [sp.Implicit(), sp.Implicit(integrator="bdf2"), sp.XPBD()])
@pytest.mark.parametrize("offset", [0.003, 0.02, 0.038])
def test_balls_that_hit_each_other_pass(tmp_path, solver, offset):
    """Their centers are on the other sides of each other in the next frame where they hit off center."""
    assert verdict(tmp_path / "a.vtkhdf", solver, other(-20), offset).verdict == "pass"


def test_a_ball_that_bounces_off_a_plate_passes(tmp_path):
    plate = sp.obstacles.Box(name="plate", center=(0, 0, 0), size=(0.004, 0.2, 0.2))
    assert verdict(tmp_path / "a.vtkhdf", sp.XPBD(), plate).verdict == "pass"
    assert verdict(tmp_path / "b.vtkhdf", sp.XPBD(), sp.RigidBody("plate", PLATE, density=1000)).verdict == "pass"


def test_things_that_miss_each_other_pass(tmp_path):
    assert verdict(tmp_path / "a.vtkhdf", BLIND, other(-20), 0.05).verdict == "pass"
