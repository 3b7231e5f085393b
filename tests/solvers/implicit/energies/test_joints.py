"""Joints of rigid bodies in `Implicit`: a chain, sliders, inputs, obstacles, coordinates."""

import numpy as np
import pytest
from scipy.optimize import brentq
from tests.scenes import G, bar, converged, hinge

import supple as sp
from supple.model.joints.geometry import JointGeometry
from supple.model.system import build_system, initial_state
from supple.scene.rotation import rotation_matrix
from supple.solvers.implicit.stepping.joint_step import coordinates_at

MASS = 2.5


def run(scene, dt, steps, integrator="backward_euler", contact=None):
    frames = converged(sp.simulate(scene, sp.Implicit(integrator=integrator, contact=contact), dt, steps))
    assert max(max(one.violation for one in frame.report.joints.values()) for frame in frames) < 1e-6
    return frames


def chain(count, span):
    """A scene of links of 0.1 m on a circular arc, and the places of the links' middles at equilibrium (count, 2)."""
    ell = 0.1
    link = sp.shapes.box_surface((ell, 0.01, 0.01), (1, 1, 1))
    radius = brentq(lambda r: 2 * r * np.sin(count * np.arcsin(ell / (2 * r))) - span, 1.2 * count * ell / 6.2832, 99)
    angles = (np.arange(count + 1) - count / 2) * 2 * np.arcsin(ell / (2 * radius))
    nodes = np.column_stack([radius * np.sin(angles), -radius * np.cos(angles), 0 * angles])
    bodies, joints = [], []
    for i in range(count):
        way = nodes[i + 1] - nodes[i]
        place = {"position": 0.5 * (nodes[i] + nodes[i + 1]), "rotation": (0, 0, np.arctan2(way[1], way[0]))}
        bodies.append(sp.RigidBody(f"{i}", link, density=1000.0, **place))
        joints.append(sp.HingeJoint(f"{i}", f"{i - 1}" if i else None, point=nodes[i]))
    joints.append(sp.HingeJoint(f"{count - 1}", point=nodes[-1]))
    # Forces along a chain of equal links: the slope grows by the same from middle to middle.
    rises = np.arange(count) - 0.5 * (count - 1)
    slopes = rises / brentq(lambda pull: (ell / np.hypot(1.0, rises / pull)).sum() - span, 1e-3, 1e3)
    steps = ell * np.column_stack([np.ones(count), slopes]) / np.hypot(1.0, slopes)[:, None]
    return sp.Scene(bodies, joints=joints), nodes[0, :2] + np.cumsum(steps, axis=0) - 0.5 * steps


@pytest.mark.parametrize("count", [6, pytest.param(20, marks=pytest.mark.slow)])
def test_a_chain_hangs_in_its_catenary(count):
    scene, expected = chain(count, 0.075 * count)
    (frame,) = run(scene, 1.0, 1, "static")
    found = np.array([pose.translation[:2] for pose in frame.poses.values()])
    assert np.abs(found - expected).max() < 1e-3 * np.ptp(expected[:, 1])
    weight = count * 0.01 * G
    ends = [frame.report.joints[f"HingeJoint {k}"].force[1] for k in (1, count + 1)]
    np.testing.assert_allclose(ends, weight / 2, rtol=1e-3)


def test_a_slider_between_moving_bodies_slides():
    """Pushed apart by a force along the axis, while both turn."""
    motor = sp.ForceMotor(2.0)
    spin = {"angular_velocity": (0, 0, 1)}
    second = bar("b", position=(0.5, 0, 0.2), **spin)
    scene = sp.Scene([bar("a", **spin), second], joints=[sp.SliderJoint("a", "b", motor=motor)], gravity=(0, 0, 0))
    frames = run(scene, 0.01, 30)
    # Backward Euler, along the axis about which both turn: each with the acceleration F / m.
    n = 30
    travel = frames[-1].report.joints["SliderJoint 1"].coordinate
    assert travel == pytest.approx(2 * 0.5 * (2.0 / MASS) * 1e-4 * n * (n + 1), rel=1e-3)
    turned = frames[-1].poses["a"].rotation.T @ frames[-1].poses["b"].rotation
    np.testing.assert_allclose(turned, np.eye(3), atol=1e-6)


def test_a_program_drives_motors_by_inputs():
    motor = sp.PositionMotor(sp.MotorInput("elbow"), stiffness=2000.0, damping=200.0)
    scene = sp.Scene([bar()], joints=[hinge()], gravity=(0, 0, 0)).with_motors({"hinge": motor})
    assert set(scene.inputs) == {"elbow"}
    frames = sp.simulate(scene, sp.Implicit(contact=None), 0.01, 60, control=lambda frame: {"elbow": 0.4})
    assert list(frames)[-1].report.joints["hinge"].coordinate == pytest.approx(0.4, abs=1e-3)
    assert scene.with_motors({"hinge": None}).motors == {}
    with pytest.raises(sp.SceneError, match="no hinge or slider has the name 'hing'; did you mean 'hinge'"):
        scene.with_motors({"hing": None})
    with pytest.raises(sp.SceneError, match=r"input 'elbow' is \[1.0, 2.0\]; give one finite number"):
        sp.MotorInput("elbow", [1.0, 2.0])


def test_a_joint_follows_an_obstacle():
    """A bar on the rim of a scripted wheel, clamped to it."""
    wheel = sp.obstacles.Sphere(
        radius=0.1, center=(-0.3, 0, 0), name="wheel", motion=sp.Keyframes([0, 1], angles=[0, 2.0])
    )
    scene = sp.Scene([bar()], obstacles=[wheel], joints=[sp.FixedJoint("bar", "wheel")])
    frame = run(scene, 0.02, 25, contact=sp.IPCContact())[-1]
    R, t = wheel.pose(0.5)
    np.testing.assert_allclose(frame.poses["bar"].translation, R @ (0.5, 0, 0) + t, atol=1e-5)
    np.testing.assert_allclose(frame.poses["bar"].rotation, R, atol=1e-4)


def test_joined_bodies_overlap_unless_they_shall_collide():
    bodies = [bar("a", density=1000.0), bar("b", position=(1.45, 0, 0))]
    joint = sp.HingeJoint("a", "b", point=(0.97, 0, 0))
    run(sp.Scene(bodies, joints=[joint]), 0.01, 2, contact=sp.IPCContact())
    touching = sp.HingeJoint("a", "b", point=(0.97, 0, 0), collide=True)
    with pytest.raises(sp.SceneError, match="body 'a' overlaps body 'b' at the start"):
        sp.simulate(sp.Scene(bodies, joints=[touching]), sp.Implicit(), 0.01, 1)


def test_coordinates_are_measured_from_where_the_scene_places_the_bodies():
    body = bar()
    scene = sp.Scene([body], joints=[hinge(limits=(0.5, 4.0))])
    turned = body.place(body.points) @ rotation_matrix((0, 0, 3.5)).T
    state = initial_state(scene, {"bar": turned})
    assert coordinates_at(JointGeometry.of(build_system(scene)), state) == pytest.approx([3.5])
    for limits, angle in (((0.0, 10.0), 3.5), ((-9.0, -2.0), -2.783), (None, -2.783), ((8, 12), 9.783)):
        geometry = JointGeometry.of(build_system(sp.Scene([body], joints=[hinge(limits=limits)])))
        assert coordinates_at(geometry, state) == pytest.approx([angle], abs=1e-3)
