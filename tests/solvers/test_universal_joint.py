"""The universal joint in both solvers: two turns are free, the third is carried, as Cardan's formula has it."""

import numpy as np
import pytest
from tests.scenes import BAR, bar, converged, momenta, rigid

import supple as sp
from supple.scene.rotation import rotation_matrix

SOLVERS = {"xpbd": sp.XPBD(substeps=10), "implicit": sp.Implicit(contact=None, integrator="bdf2")}
BOTH = pytest.mark.parametrize("solver", SOLVERS.values(), ids=SOLVERS)
BEND = 0.6


def shafts():
    """Two shafts at an angle, the first driven; the axes of their joint are across the first, and across the second."""
    along = np.array([np.cos(BEND), np.sin(BEND), 0.0])
    bodies = [
        rigid("in", BAR, position=(-0.5, 0, 0)),
        rigid("out", BAR, position=0.5 * along, rotation=(0, 0, BEND)),
    ]
    joints = [
        sp.HingeJoint("in", point=(-1, 0, 0), axis=(1, 0, 0), motor=sp.VelocityMotor(4.0), name="drive"),
        sp.UniversalJoint("in", "out", point=(0, 0, 0), axis=(0, 0, 1), second_axis=(-along[1], along[0], 0), name="u"),
        sp.BallJoint("out", point=along, name="bearing"),
    ]
    return sp.Scene(bodies, joints=joints, gravity=(0, 0, 0)), along


@BOTH
def test_a_bent_shaft_turns_by_cardans_formula(solver):
    scene, along = shafts()
    frames = converged(sp.simulate(scene, solver, 0.01, 60))
    for frame in frames[1:]:
        first = frame.poses["in"].rotation
        turned = np.arctan2(-first[1, 2], first[2, 2])
        out = frame.poses["out"].rotation @ rotation_matrix((0, 0, BEND)).T
        across = np.array([-along[1], along[0], 0.0])
        found = np.arctan2((out @ across) @ np.cross(along, across), (out @ across) @ across)
        wanted = np.arctan2(np.sin(turned) * np.cos(BEND), np.cos(turned))
        assert abs((found - wanted + np.pi) % (2 * np.pi) - np.pi) < 2e-3
    assert turned > 2.0


@BOTH
def test_two_free_bodies_keep_their_momenta_and_the_torque_is_about_the_normal_of_both_axes(solver):
    bodies = [
        rigid("a", BAR, position=(-0.5, 0, 0), angular_velocity=(3, 0.5, 0)),
        rigid("b", BAR, position=(0.5, 0, 0), velocity=(0, 0.3, 0)),
    ]
    joint = sp.UniversalJoint("a", "b", point=(0, 0, 0), axis=(0, 1, 0), second_axis=(0, 0, 1), name="u")
    scene = sp.Scene(bodies, joints=[joint], gravity=(0, 0, 0))
    frames = converged(sp.simulate(scene, solver, 0.005, 40))
    linear, angular = momenta(frames[1:])
    np.testing.assert_allclose(linear, np.broadcast_to(linear[0], linear.shape), atol=1e-6)
    np.testing.assert_allclose(
        angular, np.broadcast_to(angular[0], angular.shape), atol=3e-3 * np.abs(angular[0]).max()
    )
    for frame in frames[1:]:
        axes = [frame.poses["a"].rotation @ [0, 1, 0], frame.poses["b"].rotation @ [0, 0, 1]]
        assert abs(np.dot(*axes)) < 1e-4
        torque = frame.report.joints["u"].torque
        assert max(abs(torque @ axis) for axis in axes) < 0.05 * max(np.linalg.norm(torque), 1.0)


@BOTH
def test_the_torque_of_a_weight_beside_the_shaft_is_carried(solver):
    """The center is 0.1 m beside the joint: 0.1 m g about the shaft, which is x."""
    body = bar(position=(0, 0, 0.1))
    joint = sp.UniversalJoint("bar", point=(0, 0, 0), axis=(0, 1, 0), second_axis=(0, 0, 1), name="u")
    frames = converged(sp.simulate(sp.Scene([body], joints=[joint]), solver, 0.01, 5))
    weight = 2.5 * 9.81
    found = frames[-1].report.joints["u"]
    np.testing.assert_allclose(found.force, (0, weight, 0), atol=1e-3 * weight)
    np.testing.assert_allclose(found.torque, (-0.1 * weight, 0, 0), atol=1e-3 * weight)
    assert found.coordinate is None


@BOTH
def test_the_swing_is_limited(solver):
    joint = sp.UniversalJoint("bar", point=(0, 0, 0), axis=(0, 1, 0), second_axis=(0, 0, 1), max_swing=0.4, name="u")
    frames = list(sp.simulate(sp.Scene([bar()], joints=[joint]), solver, 0.01, 60))
    swings = [frame.report.joints["u"].coordinate for frame in frames]
    assert max(swings) < 0.4 + 2e-3
    assert swings[-1] == pytest.approx(0.4, abs=2e-3)
