"""Losses of everything that frames read have gradients and Jacobians that are those of whole runs."""

from dataclasses import replace

import numpy as np
import pytest
from tests.gradients import scenes
from tests.gradients.scenes import implicit

import supple as sp


def bent(p):
    """A bar with sensors: of a part, about an axis and about its own; from a place in it to one in the world."""
    scene = scenes.cantilever([p[0], p[1], 1, 20 * p[2]])
    tip = scenes.end(scene.bodies[0], 1)
    sensors = [
        sp.AngleSensor("bend", "bar", tip, axis=(0, 0, 1)),
        sp.AngleSensor("turn", "bar", tip),
        sp.DistanceSensor("gap", ("bar", (0.17, 0.01, 0.02)), (None, (0.1, 0.2 * p[2], 0.3))),
        sp.DistanceSensor("length", ("bar", 2), ("bar", 17)),
        sp.ForceSensor("touch", "bar"),
    ]
    return replace(scene, sensors=sensors)


def turning(p):
    """A rigid body whose shape, and so where its surface is, depends on parameters."""
    shape = sp.shapes.box((0.2 * p[0], 0.1, 0.1 * p[1]), (2, 1, 1))
    body = sp.RigidBody("bar", shape, density=1000 * p[2], velocity=(0.1, 0, 0.2), angular_velocity=(2, 1, 3))
    return sp.Scene(
        [body], sensors=[sp.AngleSensor("turn", "bar"), sp.DistanceSensor("gap", ("bar", 3), (None, (0, 1, 0)))]
    )


def swing(p):
    """A ball joint with a limit of its swing, and a hinge whose axis depends on parameters."""
    scene = scenes.chain([p[0], p[1], 1])
    axis = (0.2 * (p[2] - 1), 0, 1)
    ball = sp.BallJoint("bar", "base", point=(-0.12, 0, 0), name="shoulder", axis=(1, 0, 0), max_swing=1.5)
    hinge = sp.HingeJoint("other", "bar", point=(0.125, 0, 0), axis=axis, name="elbow")
    return replace(scene, joints=[ball, hinge])


def gas(p):
    """A gas that is pumped in."""
    return scenes.hollow(p, gas=sp.Gas(amount=lambda t: 4.107e-3 * (1 + 2 * p[2] * t)))


CASES = [
    (bent, "sensor", "bend", 0.1),
    (bent, "sensor", "turn", 0.1),
    (bent, "sensor", "gap", 0.1),
    (bent, "sensor", "length", 0.1),
    (turning, "sensor", "turn", 0.1),
    (turning, "sensor", "gap", 0.1),
    (turning, "positions", "bar", np.full((1, 3), 0.1)),
    (turning, "velocities", "bar", np.full((1, 3), 0.1)),
    (scenes.inflated, "volume", "bar", 1e-4),
    (scenes.inflated, "pressure", "bar", 1e4),
    (gas, "pressure", "bar", 1e4),
    (scenes.filled, "pressure", "bar", 1e4),
    (scenes.tendon, "length", "cable", 0.3),
    (swing, "joint", "shoulder", 0.1),
    (swing, "joint", "elbow", 0.1),
]


@pytest.mark.parametrize(("scene_of", "quantity", "of", "target"), CASES)
def test_of_states(scene_of, quantity, of, target):
    compare(scene_of, 4 if scene_of is scenes.tendon else 3, quantity, of, target)


@pytest.mark.parametrize("scene_of", [scenes.frictionless, scenes.sliding, scenes.on_moving_floor])
def test_forces_of_obstacles(scene_of):
    solver = implicit("backward_euler" if scene_of is scenes.on_moving_floor else "bdf2")
    compare(scene_of, 4, "reaction", "floor", [0.0, 1.0, 0.0], solver, steps=8)


@pytest.mark.parametrize("iterations", [1, 30])
@pytest.mark.parametrize("scene_of", [scenes.frictionless, scenes.sliding, scenes.on_ball])
def test_contact_of_a_body(scene_of, iterations):
    solver = implicit("backward_euler" if iterations == 30 else "bdf2", iterations)
    compare(scene_of, 4, "contact", "bar", [0.0, 1.0, 0.0], solver, steps=8)


def compare(scene_of, q, quantity, of, target, solver=None, steps=4):
    rows = [3] if np.ndim(target) == 2 else None
    loss = sp.Misfit(quantity, of, target, vertices=rows)
    one = sp.Sensitivity(scene_of, loss, solver or implicit(), dt=0.01, steps=steps)
    found = one.check(np.ones(q), 1, step=3e-6)
    assert found.relative <= 1e-5, str(found)
    residuals, J = one.residuals_and_jacobian(np.ones(q))
    gradient = one.value_and_gradient(np.ones(q))[1]
    assert np.abs(2 * residuals @ J - gradient).max() <= 1e-5 * np.abs(gradient).max()


def test_what_has_no_derivative_says_so():
    def of(scene_of, quantity, name, target=0.1):
        loss = sp.Misfit(quantity, name, target)
        with pytest.raises(sp.SceneError) as caught:
            sp.Sensitivity(scene_of, loss, implicit(), dt=0.01, steps=1).value_and_gradient(np.ones(4))
        return str(caught.value)

    assert "give the 'reaction' of what it touches" in of(bent, "sensor", "touch")
    assert "sensor 'bond' does not exist; did you mean 'bend'?" in of(bent, "sensor", "bond")
    assert "body 'bat' does not exist" in of(bent, "contact", "bat", [0.0, 0.0, 0.0])
    assert "joint 'knee' does not exist" in of(swing, "joint", "knee")
    assert "has no coordinate" in of(scenes.chain, "joint", "shoulder")
    with pytest.raises(sp.SceneError, match="give a number, or one for each frame"):
        sp.Misfit("sensor", "bend", np.zeros((2, 3)))
