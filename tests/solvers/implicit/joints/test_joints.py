"""Joints of rigid bodies: pendulums, a gyroscope, a chain, limits, motors, reactions."""

import h5py
import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from scipy.special import ellipk
from tests.recordings import set_in_scene
from tests.scenes import G, bar, converged, gyroscope, hinge, rate_of_precession

import supple as sp
from supple.model.joints.geometry import JointGeometry
from supple.model.system import build_system, initial_state
from supple.scene.rotation import rotation_matrix
from supple.solvers.implicit.joints.joint_step import coordinates_at

MASS = 2.5


def run(scene, dt, steps, integrator="backward_euler", contact=None):
    frames = converged(sp.simulate(scene, sp.Implicit(integrator=integrator, contact=contact), dt, steps))
    assert max(max(one.violation for one in frame.report.joints.values()) for frame in frames) < 1e-6
    return frames


def test_a_compound_pendulum_has_its_period():
    """Released at 60 degrees; the exact period is that of the elliptic integral."""
    a = np.radians(60.0)
    down = np.array([np.sin(a), -np.cos(a), 0.0])
    body = bar(position=0.5 * down, rotation=(0, 0, a - np.pi / 2))
    frames = run(sp.Scene([body], joints=[hinge()]), 0.01, 100, "bdf2")
    inertia = body.properties.inertia[2, 2] + 0.25 * MASS
    quarter = np.sqrt(inertia / (MASS * G * 0.5)) * ellipk(np.sin(a / 2) ** 2)
    sides = np.array([frame.poses["bar"].translation[0] for frame in frames])
    at = np.flatnonzero(sides[1:] * sides[:-1] < 0.0)[0]
    crossed = 0.01 * (at + 1 + sides[at] / (sides[at] - sides[at + 1]))
    assert crossed == pytest.approx(quarter, rel=0.003)
    # At the bottom, the hinge carries the weight and the centripetal force.
    rate2 = 2.0 * MASS * G * 0.5 * (1.0 - np.cos(a)) / inertia
    assert frames[at].report.joints["hinge"].force[1] == pytest.approx(MASS * (G + rate2 * 0.5), rel=0.01)


def test_a_double_pendulum_keeps_its_energy():
    scene = sp.Scene(
        [bar("a"), bar("b", position=(1.5, 0, 0))],
        joints=[hinge("a"), hinge("b", "a", point=(1, 0, 0), name="elbow")],
    )
    frames = run(scene, 0.005, 160, "bdf2")
    energies = np.array([frame.report.kinetic_energy + frame.report.potential_energy for frame in frames])
    assert np.ptp(energies) < 0.004 * np.ptp([frame.report.kinetic_energy for frame in frames])


def test_a_gyroscope_precesses():
    scene, rate = gyroscope()
    frames = run(scene, 1e-3, 200, "bdf2")
    assert rate_of_precession(frames, 1e-3, 1e-3) == pytest.approx(rate, rel=0.01)


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


def test_joints_between_bodies_keep_momentum():
    turning = np.array([0.0, 2.0, 3.0])
    first = bar("a", angular_velocity=turning)
    second = bar("b", position=(1.5, 0, 0), velocity=np.cross(turning, (0.5, 0, 0)))
    for joint in (sp.BallJoint("a", "b", point=(1, 0, 0)), sp.FixedJoint("a", "b"), sp.SliderJoint("a", "b")):
        frames = run(sp.Scene([first, second], joints=[joint], gravity=(0, 0, 0)), 0.005, 20, "bdf2")
        P, L = (np.array([getattr(f.report, key) for f in frames]) for key in ("linear_momentum", "angular_momentum"))
        assert np.abs(P - P[0]).max() < 1e-11 * np.linalg.norm(P[0])
        # That of a free body, by the integrator: see docs/theory/rigid_bodies.md.
        assert np.abs(L - L[0]).max() < 1e-3 * np.linalg.norm(L[0])


def test_what_the_fixed_joint_of_a_cantilever_carries():
    scene = sp.Scene([bar()], joints=[sp.FixedJoint("bar", point=(0, 0, 0), name="clamp")])
    clamp = run(scene, 0.01, 3)[-1].report.joints["clamp"]
    np.testing.assert_allclose(clamp.force, [0, MASS * G, 0], atol=1e-4 * MASS * G)
    np.testing.assert_allclose(clamp.torque, [0, 0, MASS * G * 0.5], atol=1e-4 * MASS * G)
    assert (clamp.coordinate, clamp.motor_force) == (None, None)


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


LIMITS = (-0.4, 0.3)


@pytest.mark.parametrize(
    ("motor", "end"),
    [
        (None, LIMITS[0]),
        (sp.PositionMotor(0.2, stiffness=1e4, damping=1e3), 0.2),
        (sp.PositionMotor(0.2, stiffness=1e4, damping=1e2, max_force=10.0), LIMITS[0]),
        (sp.VelocityMotor(sp.Curve([0.0, 0.3], [0.0, 1.0])), LIMITS[1]),
        (sp.VelocityMotor(0.0, max_force=10.0), LIMITS[0]),
        (sp.VelocityMotor(0.0, max_force=13.0), 0.0),
        (sp.ForceMotor(lambda t: 20.0), LIMITS[1]),
    ],
)
def test_motors_reach_their_targets_and_never_exceed_their_maximum_and_limits_hold(motor, end):
    """The weight turns the hinge with 12.26 N m."""
    frames = run(sp.Scene([bar()], joints=[hinge(limits=LIMITS, motor=motor)]), 0.01, 60)
    readings = [frame.report.joints["hinge"] for frame in frames]
    assert readings[-1].coordinate == pytest.approx(end, abs=2e-3)
    assert all(LIMITS[0] - 1e-6 < one.coordinate < LIMITS[1] + 1e-6 for one in readings)
    if motor is not None:
        assert max(abs(one.motor_force) for one in readings) <= (motor.max_force or np.inf)
        if motor.max_force == 10.0:  # on the way down
            assert readings[10].motor_force == 10.0


def test_a_velocity_motor_gives_its_rate_over_many_turns():
    frames = run(sp.Scene([bar()], joints=[hinge(axis=(0, 1, 0), motor=sp.VelocityMotor(30.0))]), 0.01, 50)
    angles = [frame.report.joints["hinge"].coordinate for frame in frames]
    np.testing.assert_allclose(angles, 0.3 * np.arange(1, 51), atol=1e-5)


def test_limits_and_motors_count_whole_turns():
    """A motor winds a hinge up to its limit after almost three turns; a run continues there with the same bits."""
    upright = {"axis": (0, 1, 0), "limits": (-1.0, 18.0)}
    scene = sp.Scene([bar()], joints=[hinge(**upright, motor=sp.VelocityMotor(60.0, max_force=1e4))])
    solver = sp.Implicit(contact=None)
    frames = run(scene, 0.01, 40)
    angles = np.array([frame.report.joints["hinge"].coordinate for frame in frames])
    assert angles[28] == pytest.approx(29 * 0.6, abs=1e-5)
    np.testing.assert_allclose(angles[30:], 18.0, atol=1e-6)
    assert frames[-1].state.hinge_angles == {"hinge": angles[-1]}
    rest = list(sp.simulate(scene, solver, 0.01, 1, start=frames[-2]))
    np.testing.assert_array_equal(rest[-1].state.positions, frames[-1].state.positions)
    # A position motor goes back all the way.
    back = sp.Scene([bar()], joints=[hinge(**upright, motor=sp.PositionMotor(1.0, 400.0, 80.0))])
    first, *_, last = sp.simulate(back, solver, 0.05, 60, start=frames[-1].state)
    assert first.report.joints["hinge"].coordinate < 18.0 - 1e-2
    assert last.report.joints["hinge"].coordinate == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize(
    ("values", "end"),
    [
        ({"damping": 40.0}, None),
        ({"friction": 13.0}, 0.0),
        ({"friction": 10.0}, LIMITS[0]),
        ({"motor": sp.VelocityMotor(0.0), "max_effort": 10.0}, LIMITS[0]),
        ({"motor": sp.ForceMotor(20.0, max_force=30.0), "max_effort": 15.0}, LIMITS[1]),
        ({"motor": sp.ForceMotor(13.0), "friction": 2.0}, 0.0),
    ],
)
def test_damping_friction_and_the_largest_effort_of_a_joint(values, end):
    """The weight turns the hinge with 12.26 N m; a damped one goes with 12.26 / 40 rad/s after a while."""
    frames = run(sp.Scene([bar()], joints=[hinge(limits=LIMITS, **values)]), 0.01, 60 if end else 10)
    readings = [frame.report.joints["hinge"] for frame in frames]
    if end is not None:
        assert readings[-1].coordinate == pytest.approx(end, abs=1e-5)
        assert (readings[-1].motor_force is None) == ("motor" not in values)
        assert max(abs(one.motor_force or 0.0) for one in readings) <= 15.0
        return
    # Backward Euler: q' = -(12.26 / d) (1 - (1 + d h / I)^-n), as long as the arm is horizontal.
    rate = (readings[9].coordinate - readings[8].coordinate) / 0.01
    inertia = bar().properties.inertia[2, 2] + 0.25 * MASS
    exact = -MASS * G * 0.5 / 40.0 * (1.0 - (1.0 + 0.4 / inertia) ** -10)
    assert rate == pytest.approx(exact, rel=0.005)


@pytest.mark.parametrize("motor", [None, sp.VelocityMotor(5.0), sp.ForceMotor(20.0), sp.PositionMotor(-2.0, 1e4, 10.0)])
def test_the_rate_of_a_joint_is_limited_and_the_check_finds_faster_ones(motor, tmp_path):
    """The weight, a motor without a largest force, and what turns already at the start: all move with that rate."""
    scene = sp.Scene([bar(angular_velocity=(0, 0, -3.0))], joints=[hinge(max_velocity=0.5, motor=motor)])
    solver, path = sp.Implicit(contact=None), tmp_path / "r.vtkhdf"
    frames = converged(sp.simulate(scene, solver, 0.01, 30, sinks=[sp.Recorder(path, solver=solver)]))
    angles = np.array([0.0, *(frame.report.joints["hinge"].coordinate for frame in frames)])
    way = 1.0 if isinstance(motor, sp.VelocityMotor | sp.ForceMotor) else -1.0
    np.testing.assert_allclose(np.diff(angles)[12:], way * 0.005, atol=1e-6)
    assert np.abs(np.diff(angles)).max() < 0.005 + 1e-6
    assert sp.check_recording(path)["joints"].verdict == "pass"
    if motor is None:  # the limit carries all of the weight's torque
        reading = frames[10].report.joints["hinge"]
        assert reading.torque[2] == pytest.approx(MASS * G * 0.5 * np.cos(reading.coordinate), rel=0.01)


def test_a_program_drives_motors_by_inputs():
    motor = sp.PositionMotor(sp.MotorInput("elbow"), stiffness=2000.0, damping=200.0)
    scene = sp.Scene([bar()], joints=[hinge()], gravity=(0, 0, 0)).with_motors({"hinge": motor})
    assert set(scene.inputs) == {"elbow"}
    frames = sp.simulate(scene, sp.Implicit(contact=None), 0.01, 60, control=lambda frame: {"elbow": 0.4})
    assert list(frames)[-1].report.joints["hinge"].coordinate == pytest.approx(0.4, abs=1e-3)
    own = scene.with_own_inputs()
    assert own.motors["hinge"].script is not motor.script
    assert own.motors["hinge"].stiffness == 2000.0
    assert scene.with_motors({"hinge": None}).motors == {}
    with pytest.raises(sp.SceneError, match="no hinge or slider has the name 'hing'; did you mean 'hinge'"):
        scene.with_motors({"hing": None})
    with pytest.raises(sp.SceneError, match=r"input 'elbow' is \[1.0, 2.0\]; give one finite number"):
        sp.MotorInput("elbow", [1.0, 2.0])


def test_the_swing_of_a_ball_is_limited():
    """A bar that falls from the horizontal stops at its cone, about which it may turn."""
    joint = sp.BallJoint("bar", point=(0, 0, 0), axis=(1, 0, 0), max_swing=0.5, name="ball")
    frames = run(sp.Scene([bar(angular_velocity=(3, 0, 0))], joints=[joint]), 0.01, 80)
    swings = np.array([frame.report.joints["ball"].coordinate for frame in frames])
    directions = np.array([frame.poses["bar"].rotation[:, 0] for frame in frames])
    np.testing.assert_allclose(swings, np.arccos(directions[:, 0]), atol=1e-4)
    assert swings.max() < 0.5 + 1e-6
    assert swings[-1] == pytest.approx(0.5, abs=1e-6)
    assert np.einsum("ij,ij->i", frames[-1].poses["bar"].rotation, frames[0].poses["bar"].rotation).sum() < 2.0
    # At rest on the cone: the weight's torque about the joint is carried by the limit.
    torque = frames[-1].report.joints["ball"].torque
    assert torque @ (0, 0, 1) == pytest.approx(MASS * G * 0.5 * directions[-1, 0], rel=0.02)


def twist_of(rotation):
    """About x of the quaternion (q, w): the turn about x that a turn about a line across it follows."""
    x, _, _, w = Rotation.from_matrix(rotation).as_quat()
    return 2.0 * np.arctan2(x, w)


def test_the_twist_of_a_ball_is_limited_and_the_check_finds_larger_ones(tmp_path):
    """A bar that falls into its cone and turns about its axis on the way stops at a twist of 0.4, swung by 0.5."""
    joint = sp.BallJoint("bar", point=(0, 0, 0), axis=(1, 0, 0), max_swing=0.5, twist_limits=(-0.2, 0.4), name="ball")
    solver, twists = sp.Implicit(contact=None), {}
    for rate in (3.0, -3.0):
        path = tmp_path / f"{rate}.vtkhdf"
        scene = sp.Scene([bar(angular_velocity=(rate, 0, 0))], joints=[joint])
        frames = converged(sp.simulate(scene, solver, 0.01, 60, sinks=[sp.Recorder(path, solver=solver)]))
        twists[rate] = np.array([twist_of(frame.poses["bar"].rotation) for frame in frames])
        assert frames[-1].report.joints["ball"].coordinate == pytest.approx(0.5, abs=1e-6)
        assert sp.check_recording(path)["joints"].verdict == "pass"
    assert twists[3.0].max() == pytest.approx(0.4, abs=1e-6)
    assert twists[-3.0].min() == pytest.approx(-0.2, abs=1e-6)
    with h5py.File(path, "r+") as file:
        set_in_scene(file, "joints/0/conditions/functions/1/limits", (-0.1, 0.4))
    found = sp.check_recording(path)["joints"]
    assert (found.verdict, found.worst) == ("fail", pytest.approx(0.1, abs=1e-6))


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


def test_a_run_continues_with_the_same_bits():
    scene = sp.Scene([bar()], joints=[hinge(limits=(-1.0, 1.0), motor=sp.VelocityMotor(1.0, max_force=9.0))])
    solver = sp.Implicit(integrator="bdf2", contact=None)
    whole = list(sp.simulate(scene, solver, 0.01, 6))
    rest = list(sp.simulate(scene, solver, 0.01, 3, start=whole[2]))
    np.testing.assert_array_equal(rest[-1].state.positions, whole[-1].state.positions)
    assert rest[-1].report.joints["hinge"].motor_force == whole[-1].report.joints["hinge"].motor_force


def test_coordinates_are_measured_from_where_the_scene_places_the_bodies():
    body = bar()
    scene = sp.Scene([body], joints=[hinge(limits=(0.5, 4.0))])
    turned = body.place(body.points) @ rotation_matrix((0, 0, 3.5)).T
    state = initial_state(scene, {"bar": turned})
    assert coordinates_at(JointGeometry.of(build_system(scene)), state) == pytest.approx([3.5])
    for limits, angle in (((0.0, 10.0), 3.5), ((-9.0, -2.0), -2.783), (None, -2.783), ((8, 12), 9.783)):
        geometry = JointGeometry.of(build_system(sp.Scene([body], joints=[hinge(limits=limits)])))
        assert coordinates_at(geometry, state) == pytest.approx([angle], abs=1e-3)
