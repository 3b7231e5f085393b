"""Joints and welds with `newmark`: energy, order, precession, momenta, and where limits and motors act."""

from dataclasses import replace

import numpy as np
import pytest

import supple as sp
from supple.model.system import build_system, initial_state
from supple.solvers.implicit.details import ImplicitDetails
from supple.solvers.implicit.energies.potential import HessianBlocks
from supple.solvers.implicit.joints.rigidity import Rigidity

from .conftest import bar, hinge

G = 9.81
MASS = 2.5
INERTIA = bar().properties.inertia[2, 2] + 0.25 * MASS  # about the hinge
SOFT = sp.StableNeoHookean(youngs=2e5, poisson=0.3, density=1000)
WEIGHT = MASS * G * 0.5  # its torque about the hinge, level


def run(scene, dt, steps, contact=None):
    frames = list(sp.simulate(scene, sp.Implicit(integrator="newmark", contact=contact), dt, steps))
    assert {frame.report.status for frame in frames} == {"converged"}
    for frame in frames:
        assert max([one.violation for one in frame.report.joints.values()], default=0.0) < 1e-7
        assert isinstance(frame.report.details, ImplicitDetails)
        assert max(frame.report.details.orthogonality_errors.values()) < 1e-7
    return frames


def double_pendulum(dt, time):
    """Two bars, released level."""
    bodies = [bar("a"), bar("b", position=(1.5, 0, 0))]
    joints = [hinge("a"), hinge("b", "a", point=(1, 0, 0), name="elbow")]
    return run(sp.Scene(bodies, joints=joints), dt, round(time / dt))


def energies(frames):
    return np.array([frame.report.kinetic_energy + frame.report.potential_energy for frame in frames])


@pytest.mark.parametrize("time", [0.6, pytest.param(20.0, marks=pytest.mark.slow)])
def test_a_double_pendulum_keeps_its_energy(time):
    """It can release 49 J, and turns over several times in 20 s."""
    assert np.ptp(energies(double_pendulum(0.01, time))) < 1e-4


def test_the_error_is_of_second_order():
    found = [double_pendulum(dt, 0.24)[-1].poses["b"].translation for dt in (0.02, 0.01, 0.0025)]
    errors = [np.linalg.norm(one - found[-1]) for one in found[:2]]
    assert errors[0] < 1e-3
    assert errors[0] / errors[1] == pytest.approx((1 - 1 / 64) / (1 / 4 - 1 / 64), rel=0.05)


def test_a_spinning_top_precesses():
    """With a horizontal axis the steady precession is m g l / (I w), exactly."""
    length, spin = 0.1, 50.0
    disk = sp.shapes.box_surface((0.2, 0.02, 0.2), (1, 1, 1))
    inertia = sp.RigidBody("disk", disk, density=2700.0).properties
    rate = inertia.mass * G * length / (inertia.inertia[1, 1] * spin)
    place = {"position": (length, 0, 0), "rotation": (0, 0, -np.pi / 2), "velocity": (0, 0, -rate * length)}
    body = sp.RigidBody("disk", disk, density=2700.0, angular_velocity=(spin, rate, 0), **place)
    frames = run(sp.Scene([body], joints=[sp.BallJoint("disk", point=(0, 0, 0))]), 4e-3, 60)
    centers = np.array([frame.poses["disk"].translation for frame in frames])
    angles = np.unwrap(np.arctan2(-centers[:, 2], centers[:, 0]))
    assert (angles[-1] - angles[0]) / (59 * 4e-3) == pytest.approx(rate, rel=2e-3)
    assert np.abs(centers[:, 1]).max() < 1e-4
    assert np.ptp(energies(frames)) < 1e-6 * frames[0].report.kinetic_energy


@pytest.mark.parametrize(
    "joint",
    [
        sp.FixedJoint("a", "b"),
        sp.SliderJoint("a", "b"),
        sp.HingeJoint("a", "b", point=(1, 0, 0), damping=0.3, motor=sp.PositionMotor(0.4, 50.0, 1.0)),
    ],
)
def test_joints_between_bodies_keep_both_momenta(joint):
    turning = np.array([0.0, 2.0, 3.0])
    second = bar("b", position=(1.5, 0, 0), velocity=np.cross(turning, (1, 0, 0)), angular_velocity=turning)
    scene = sp.Scene([bar("a", angular_velocity=turning), second], joints=[joint], gravity=(0, 0, 0))
    frames = run(scene, 0.005, 25)
    P, L = (np.array([getattr(f.report, key) for f in frames]) for key in ("linear_momentum", "angular_momentum"))
    assert np.abs(P - P[0]).max() < 1e-11 * np.linalg.norm(P[0])
    assert np.abs(L - L[0]).max() < 1e-8 * np.linalg.norm(L[0])
    if not isinstance(joint, sp.HingeJoint):
        assert np.ptp(energies(frames)) < 1e-9 * frames[0].report.kinetic_energy


def turning_rates(frames):
    return np.array([frame.poses["bar"].angular_velocity[2] for frame in frames])


def angles_of(frames):
    return np.array([frame.report.joints["hinge"].coordinate for frame in frames])


@pytest.mark.parametrize("values", [{}, {"motor": sp.VelocityMotor(-9.0, max_force=1.0)}, {"friction": 2.0}])
def test_limits_stop_without_a_bounce(values):
    frames = run(sp.Scene([bar()], joints=[hinge(limits=(-0.1, 0.1), **values)]), 0.01, 25)
    angles = angles_of(frames)
    assert angles.min() > -0.1 - 1e-8
    assert angles[-1] == pytest.approx(-0.1, abs=1e-8)
    assert np.abs(turning_rates(frames)[-5:]).max() < 1e-6
    assert frames[-1].report.joints["hinge"].torque[2] == pytest.approx(WEIGHT * np.cos(0.1), rel=1e-3)


@pytest.mark.parametrize(
    "joint",
    [
        hinge(limits=(-0.1, 0.1)),
        hinge(limits=(-1.0, 0.02), motor=sp.VelocityMotor(1.0, max_force=300.0)),
        sp.BallJoint("bar", point=(0, 0, 0), axis=(1, 0, 0), max_swing=0.1, name="hinge"),
        sp.SliderJoint("bar", axis=(1, 1, 0), limits=(-0.02, 1.0), name="hinge"),
    ],
)
def test_the_force_of_a_joint_changes_the_momentum_also_where_it_stops(joint):
    """In every step, that of an impact too; its work is that of the joint, and none is left over."""
    frames = run(sp.Scene([bar()], joints=[joint]), 0.01, 20)
    P = np.array([frame.report.linear_momentum for frame in frames])
    forces = np.array([frame.report.joints["hinge"].force for frame in frames[1:]])
    np.testing.assert_allclose(forces, np.diff(P, axis=0) / 0.01 + [0, MASS * G, 0], atol=1e-9)
    assert np.abs(forces).max() > 4 * MASS * G
    assert max(abs(frame.report.work["numerical"]) for frame in frames) < 1e-5
    efforts = [frame.report.joints["hinge"].motor_force or 0.0 for frame in frames]
    assert max(map(abs, efforts)) <= 300.0


def test_a_velocity_motor_accelerates_with_the_torque_that_it_takes():
    """And stops at its limit: rates follow the motor at the ends of steps, and do not alternate about it."""
    motor = sp.VelocityMotor(sp.Curve([0.0, 0.3], [0.0, 1.0]))
    frames = run(sp.Scene([bar()], joints=[hinge(limits=(-1.0, 0.06), motor=motor)]), 0.01, 24)
    rates = turning_rates(frames)
    np.testing.assert_allclose(rates[:17], np.arange(1, 18) / 30.0, rtol=1e-5)
    torques = np.array([frame.report.joints["hinge"].motor_force for frame in frames[2:17]])
    np.testing.assert_allclose(torques, WEIGHT * np.cos(angles_of(frames)[2:17]) + INERTIA / 0.3, rtol=2e-3)
    assert np.abs(rates[-3:]).max() < 1e-6
    assert frames[-1].report.joints["hinge"].coordinate == pytest.approx(0.06, abs=1e-8)


def test_dry_friction_holds_and_the_rate_is_limited():
    held = run(sp.Scene([bar()], joints=[hinge(friction=13.0)]), 0.01, 8)
    assert np.abs(turning_rates(held)).max() < 1e-8
    limited = run(sp.Scene([bar()], joints=[hinge(max_velocity=0.2)]), 0.01, 8)
    np.testing.assert_allclose(turning_rates(limited)[3:], -0.2, atol=1e-6)
    assert limited[-1].report.joints["hinge"].torque[2] == pytest.approx(WEIGHT, rel=2e-3)


def test_velocities_that_contradict_a_joint_become_those_after_an_impact():
    """A bar that turns about its middle is caught at its end: the angular momentum about the hinge remains."""
    frames = run(sp.Scene([bar(angular_velocity=(0, 0, 4))], joints=[hinge()], gravity=(0, 0, 0)), 0.01, 5)
    caught = 4.0 * bar().properties.inertia[2, 2] / INERTIA
    np.testing.assert_allclose(turning_rates(frames), caught, rtol=1e-4)


def test_a_joint_follows_an_obstacle_and_a_held_body():
    wheel = sp.Sphere(radius=0.1, center=(-0.3, 0, 0), name="wheel", motion=sp.Keyframes([0, 1], angles=[0, 2.0]))
    scene = sp.Scene([bar()], obstacles=[wheel], joints=[sp.FixedJoint("bar", "wheel")])
    frame = run(scene, 0.02, 10, contact=sp.IPCContact())[-1]
    R, t = wheel.pose(0.2)
    np.testing.assert_allclose(frame.poses["bar"].translation, R @ (0.5, 0, 0) + t, atol=1e-6)
    scene = sp.Scene([bar("a"), bar("b", position=(1.5, 0, 0))], joints=[hinge("b", "a", point=(1, 0, 0))])
    frames = run(sp.Scene(scene.bodies, joints=scene.joints, pins=[sp.Pin("a")]), 0.01, 10)
    assert np.ptp(energies(frames)) < 1e-6


def test_a_beam_welded_to_a_turning_cube_keeps_momenta():
    beam = sp.shapes.box((0.4, 0.1, 0.1), (4, 1, 1))
    cube = sp.shapes.box_surface((0.1, 0.1, 0.1), (1, 1, 1))
    place = (-0.25, 0, 0)
    turning = sp.RigidBody("cube", cube, density=1000, position=place, velocity=(1, 0, 0), angular_velocity=(0, 2, 4))
    bodies = [sp.Body("beam", beam, SOFT, velocity=(1, 0, 0)), turning]
    scene = sp.Scene(bodies, welds=[sp.Weld("beam", "cube", max_distance=1e-6)], gravity=(0, 0, 0))
    frames = run(scene, 5e-3, 20)
    P, L = (np.array([getattr(f.report, key) for f in frames]) for key in ("linear_momentum", "angular_momentum"))
    assert np.abs(P - P[0]).max() < 1e-10 * np.linalg.norm(P[0])
    assert np.abs(L - L[0]).max() < 1e-8 * np.linalg.norm(L[0])
    total = energies(frames) + [frame.report.elastic_energy for frame in frames]
    assert np.ptp(total) < 0.02 * total[0]


@pytest.mark.slow
def test_a_jointed_bar_falls_on_a_soft_block():
    block = sp.Body("block", sp.shapes.box((0.2, 0.1, 0.2), (2, 1, 2)), SOFT)
    scene = sp.Scene(
        [bar(position=(-0.2, 0.15, 0), friction=0.3), block],
        joints=[hinge(point=(-0.7, 0.15, 0))],
        pins=[sp.Pin("block", sp.InBox((-1, -0.06, -1), (1, -0.04, 1)))],
    )
    frames = run(scene, 5e-3, 60, contact=sp.IPCContact())
    assert max(frame.report.details.contacts for frame in frames) > 0
    assert max(frame.positions["bar"][:, 1].min() for frame in frames[-20:]) < 0.1 + 0.05


def test_derivatives_of_rigidity_are_those_of_its_energy():
    scene = sp.Scene([bar("a", rotation=(0.2, 0.5, 0.1)), bar("b", position=(2, 0, 0))], joints=[hinge("a", "b")])
    system, x = build_system(scene), initial_state(scene).positions
    rng = np.random.default_rng(0)
    x = x + 0.01 * rng.normal(size=x.shape)
    energy = Rigidity.of(system)
    L = rng.normal(size=energy.multipliers.shape)
    energy = replace(energy, multipliers=L + L.transpose(0, 2, 1), weight=1.5)
    along, h = rng.normal(size=x.shape), 1e-5
    gradients = np.zeros((3, *x.shape))
    for k, step in enumerate((-h, 0.0, h)):
        energy.add_gradient(x + step * along, gradients[k])
    slope = (energy.value(x + h * along) - energy.value(x - h * along)) / (2 * h)
    assert np.vdot(gradients[1], along) == pytest.approx(slope, rel=1e-7)
    blocks = {project: HessianBlocks.zeros(2, len(x)) for project in (False, True)}
    for project, each in blocks.items():
        energy.add_hessian(x, each, project)
    product = np.zeros_like(x)
    for nodes, block in zip(system.tets, blocks[False].tets, strict=True):
        product[nodes] += (block @ along[nodes].ravel()).reshape(4, 3)
    np.testing.assert_allclose(product, (gradients[2] - gradients[0]) / (2 * h), atol=1e-6 * np.abs(product).max())
    assert np.linalg.eigvalsh(blocks[True].tets).min() > -1e-9 * np.abs(blocks[True].tets).max()
    ahead, behind = (energy.conditions(x + step * along) for step in (h, -h))
    for a, b in ((0, 0), (0, 1), (1, 2), (2, 2)):
        rate = np.einsum("bki,bki->b", energy.gradients(x, a, b), along[energy.corners])
        np.testing.assert_allclose(rate, (ahead - behind)[:, a, b] / (2 * h), rtol=1e-6, atol=1e-9)
