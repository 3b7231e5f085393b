"""Joints of rigid bodies in `XPBD`: a chain, sliders, contact, starts and motors that are refused."""

import numpy as np
import pytest
from scipy.optimize import brentq
from tests.scenes import G, bar, converged, hinge

import supple as sp

MASS = 2.5


def run(scene, steps, substeps=10, dt=1 / 60, *, violation=1e-4, contact=None, **more):
    frames = converged(
        sp.simulate(scene, sp.XPBD(substeps=substeps, contact=contact, sleep_after=None), dt, steps, **more)
    )
    assert max(max(one.violation for one in frame.report.joints.values()) for frame in frames) < violation
    return frames


def chain(count, damping=2e-3):
    """A chain of links of 0.1 m that hangs by its first one, horizontal at the start."""
    link = sp.shapes.box_surface((0.1, 0.01, 0.01), (1, 1, 1))
    bodies = [sp.RigidBody(f"{i}", link, density=1000.0, position=(0.1 * i + 0.05, 0, 0)) for i in range(count)]
    joints = [
        sp.HingeJoint(f"{i}", f"{i - 1}" if i else None, point=(0.1 * i, 0, 0), damping=damping, name=f"{i}")
        for i in range(count)
    ]
    return bodies, joints


@pytest.mark.parametrize(
    ("count", "steps", "damping"), [(5, 75, 2e-3), pytest.param(20, 300, 2e-2, marks=pytest.mark.slow)]
)
def test_a_chain_hangs_in_its_catenary(count, steps, damping):
    """Of damped links, whose end a pin brings nearer."""
    span = 0.075 * count
    bodies, joints = chain(count, damping)
    joints[0] = sp.HingeJoint("0", point=(0, 0, 0), damping=damping, name="0")
    block = sp.shapes.box_surface((0.02, 0.02, 0.02), (1, 1, 1))
    bodies.append(sp.RigidBody("end", block, density=1000.0, position=(0.1 * count, 0, 0)))
    joints.append(sp.HingeJoint(f"{count - 1}", "end", point=(0.1 * count, 0, 0), damping=damping, name="last"))
    motion = sp.Keyframes([0.0, 0.3], displacements=[(0, 0, 0), (span - 0.1 * count, 0, 0)])
    frames = run(sp.Scene(bodies, joints=joints, pins=[sp.Pin("end", motion=motion)]), steps, violation=1e-3)
    # Forces along a chain of equal links: the slope grows by the same from middle to middle.
    rises = np.arange(count) - 0.5 * (count - 1)
    slopes = rises / brentq(lambda pull: (0.1 / np.hypot(1.0, rises / pull)).sum() - span, 1e-3, 1e3)
    ways = 0.1 * np.column_stack([np.ones(count), slopes]) / np.hypot(1.0, slopes)[:, None]
    expected = np.cumsum(ways, axis=0) - 0.5 * ways
    found = np.array([frames[-1].poses[f"{i}"].translation[:2] for i in range(count)])
    assert np.abs(found - expected).max() < 0.01 * np.ptp(expected[:, 1])
    weight = count * 0.01 * G
    assert frames[-1].report.joints["0"].force[1] == pytest.approx(weight / 2, rel=0.01)


UP = (0, 0, np.pi / 2)


def test_a_limit_holds_what_falls_on_a_bar():
    """Without limits in the projections after contact: off by 2.5e-4 rad, and 41 % of the energy is gained."""
    box = sp.RigidBody(
        "box", sp.shapes.box_surface((0.2, 0.2, 0.2), (1, 1, 1)), density=1000.0, position=(0.8, 0.15, 0)
    )
    scene = sp.Scene([bar(), box], joints=[hinge(axis=(0, 0, 1), limits=(0, 1))])
    frames = run(scene, 20, contact=sp.XPBDContact(), violation=3e-4)
    states = [frame.report.joints["hinge"] for frame in frames]
    assert min(state.coordinate for state in states) > -5e-5
    assert max(frame.report.details.energy_gained for frame in frames) < 0.03
    torque = np.mean([state.torque[2] for state in states[-10:]])
    assert torque == pytest.approx((8.0 * 0.8 + MASS * 0.5) * G, rel=0.03)


def test_a_slider_lifts_a_bar_and_follows_turns_of_its_obstacle():
    """Its motor carries the weight; the obstacle that it is on turns about its axis."""
    motor = sp.PositionMotor(sp.Curve([0.0, 0.5], [0.0, 0.1]), stiffness=1e4, damping=1e3)
    turn = sp.Keyframes([0.0, 1.0], angles=[0.0, 1.0], axis=(0, 1, 0))
    post = sp.HalfSpace(point=(0, -3, 0), normal=(0, 1, 0), motion=turn, name="post")
    slider = sp.SliderJoint("bar", "post", axis=(0, 1, 0), motor=motor, limits=(0, 0.2), name="lift")
    last = run(sp.Scene([bar()], joints=[slider], obstacles=[post]), 60)[-1]
    reading = last.report.joints["lift"]
    assert reading.coordinate == pytest.approx(0.1 - MASS * G / 1e4, abs=1e-4)
    assert reading.motor_force == pytest.approx(MASS * G, rel=1e-3)
    np.testing.assert_allclose(last.poses["bar"].rotation[:, 0], [np.cos(1), 0, -np.sin(1)], atol=1e-4)


def test_a_cradle_of_bars_hands_its_momentum_on():
    """Without friction between the bars: in a perfectly inelastic collision both go on together."""
    first = bar("first", position=(0, -0.5, 0), rotation=UP, angular_velocity=(0, 0, -2.0), velocity=(-1, 0, 0))
    second = bar("second", position=(-0.06, -0.5, 0), rotation=UP)
    joints = [hinge("first", name="a"), hinge("second", point=(-0.06, 0, 0), name="b")]
    settings = sp.XPBDContact(thickness=1e-3)
    last = run(sp.Scene([first, second], joints=joints, gravity=(0, 0, 0)), 4, contact=settings, violation=1e-3)[-1]
    spins = [last.poses[name].angular_velocity[2] for name in ("first", "second")]
    assert sum(spins) == pytest.approx(-2.0, rel=0.01)
    np.testing.assert_allclose(spins, -1.0, rtol=0.01)


def test_a_start_at_which_the_sides_are_apart_is_refused():
    shifted = [bar(position=(0.6, 0, 0)), bar("b", position=(1.5, 0, 0))]
    joint = sp.HingeJoint("bar", "b", point=(1, 0, 0), limits=(0.1, 0.5), name="elbow")
    with pytest.raises(sp.SceneError, match=r"joint 'elbow': at the start it is at 0 rad, outside of its limits"):
        run(sp.Scene(shifted, joints=[joint]), 1)


def test_joints_that_contradict_each_other_are_named():
    """A bar on two balls, of which one moves away with its obstacle."""
    away = sp.HalfSpace(point=(0, -3, 0), normal=(0, 1, 0), motion=lambda t: (t, 0, 0), name="away")
    joints = [sp.BallJoint("bar", point=(0, 0, 0)), sp.BallJoint("bar", "away", point=(1, 0, 0), name="far")]
    frames = list(sp.simulate(sp.Scene([bar()], joints=joints, obstacles=[away]), sp.XPBD(substeps=10), 1 / 60, 20))
    assert frames[-1].report.status == "softened"
    assert "is off by" in frames[-1].report.message
    assert "take substeps=20, or remove what contradicts the joint" in frames[-1].report.message


def test_a_motor_that_nothing_can_move_is_named():
    """A slider across holds its body, and a motor without a largest force is not its cause alone."""
    across = sp.SliderJoint("bar", axis=(1, 0, 0))
    driven = sp.SliderJoint("bar", axis=(0, 1, 0), motor=sp.VelocityMotor(1.0), name="driven")
    (frame,) = sp.simulate(sp.Scene([bar()], joints=[across, driven]), sp.XPBD(substeps=10), 1 / 100, 1)
    assert frame.report.status == "softened"
    assert "joint 'driven' is off by 100 % of the way of its motor" in frame.report.message


@pytest.mark.parametrize(
    ("solver", "refusal"), [(sp.XPBD(), "softened"), (sp.Implicit(max_substeps=4), "iteration_limit")]
)
def test_a_velocity_motor_at_the_limit_of_another_joint_needs_a_largest_force(solver, refusal):
    """The limit is reached in the first of two frames."""
    for force, status in ((20.0, "converged"), (None, refusal)):
        driven = sp.SliderJoint("bar", axis=(1, 0, 0), motor=sp.VelocityMotor(0.2, max_force=force))
        stop = sp.SliderJoint("bar", axis=(1, 0, 0), limits=(-2e-3, 2e-3), name="stop")
        scene = sp.Scene([bar()], joints=[driven, stop], gravity=(0, 0, 0))
        *_, frame = sp.simulate(scene, solver, 1 / 60, 2)
        assert frame.report.status == status
        if force is not None:
            assert frame.report.joints["stop"].coordinate == pytest.approx(2e-3, abs=1e-6)
        else:
            assert "another joint" in frame.report.message


@pytest.mark.parametrize("motor", [sp.VelocityMotor(-0.1), sp.PositionMotor(lambda t: -0.1 * t, 1e6, 1e3)])
def test_motors_push_on_against_contact(motor):
    """Through 25 of 100 mm of soft material. Motors that did not answer to contact fell back by up to 11 mm."""
    material = sp.StableNeoHookean(youngs=1e5, poisson=0.3, density=1000)
    block = sp.Body("block", sp.shapes.box((0.1, 0.1, 0.1), (2, 2, 2)), material, position=(0, 0.051, 0))
    shape = sp.shapes.box_surface((0.2, 0.02, 0.2), (2, 1, 2))
    plate = sp.RigidBody("plate", shape, mass=1.0, position=(0, 0.1135, 0))
    press = sp.SliderJoint("plate", axis=(0, 1, 0), motor=motor, name="press")
    scene = sp.Scene([block, plate], obstacles=[sp.HalfSpace(friction=0.5, name="floor")], joints=[press])
    last = run(scene, 15, substeps=30, contact=sp.XPBDContact(), violation=1e-3)[-1]
    pushed = last.report.details.contact_forces["plate"][1]
    expected = -0.025 + (pushed / 1e6 if isinstance(motor, sp.PositionMotor) else 0.0)
    assert last.report.joints["press"].coordinate == pytest.approx(expected, abs=1e-4)
    assert last.report.joints["press"].motor_force == pytest.approx(G - pushed, rel=0.01)


@pytest.mark.parametrize("density", [1000.0, 8000.0])
def test_a_heavy_body_on_a_bar_at_its_limit_gains_no_energy(density):
    """8 and 64 kg hit a bar of 2.5 kg that its limit holds. Limits that only pushed left 8 times its energy."""
    box = sp.shapes.box_surface((0.2, 0.2, 0.2), (1, 1, 1))
    heavy = sp.RigidBody("box", box, density=density, position=(0.8, 0.1255, 0), velocity=(0, -0.5, 0))
    scene = sp.Scene([bar(), heavy], joints=[hinge(axis=(0, 0, 1), limits=(0, 1))])
    frames = run(scene, 2, substeps=10, contact=sp.XPBDContact(), violation=5e-4)
    blow = 0.5 * density * 0.2**3 * 0.5**2
    assert max(frame.report.kinetic_energy for frame in frames) < 0.02 * blow
    assert min(frame.report.joints["hinge"].coordinate for frame in frames) > -5e-4


def spinning(spin):
    bodies = [
        bar("a", position=(0.5, 0, 0), angular_velocity=(0, 0, spin), velocity=(0, 0.5 * spin, 0)),
        bar("b", position=(1.5, 0, 0), angular_velocity=(0, 0, -spin), velocity=(0, 0.5 * spin, 0)),
    ]
    return sp.Scene(bodies, joints=[hinge("a", point=(0, 0, 0)), sp.BallJoint("a", "b", point=(1.0, 0, 0))])


def violation(frame):
    return max(joint.violation for joint in frame.report.joints.values())


@pytest.mark.parametrize("spin", [100.0, 1000.0])
def test_joints_that_spin_fast_hold(spin):
    """With one linearization of their rows in a substep they are off by 0.004 of their size at 1,000 rad/s."""
    frames = converged(sp.simulate(spinning(spin), sp.XPBD(), 1 / 60, 4))
    assert max(map(violation, frames)) < 5e-4
    assert all(frame.report.details.repeats == 0 for frame in frames)


def test_a_frame_in_which_joints_do_not_hold_is_repeated_with_more_substeps():
    frames = list(sp.simulate(spinning(500.0), sp.XPBD(max_substeps=200), 1 / 60, 20))
    repeated = [frame for frame in frames if frame.report.details.repeats]
    assert repeated
    assert max(frame.report.details.substeps for frame in repeated) > 60
    assert all((frame.report.status == "softened") == (violation(frame) > 1e-3) for frame in frames)
