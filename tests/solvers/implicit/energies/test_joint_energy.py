"""The energy of joints against finite differences, and laws of limits and motors."""

import numpy as np
import pytest
from tests.derivatives import assert_derivatives, differences, hessian_product

import supple as sp
from supple.model.joints.geometry import JointGeometry
from supple.model.joints.laws import Law, Laws, begin_step
from supple.model.system import build_system, initial_state
from supple.solvers.implicit.energies.potential import HessianBlocks
from supple.solvers.implicit.stepping.joint_step import JointStep

BOX = sp.shapes.box_surface((0.4, 0.2, 0.1), (1, 1, 1))
AXIS = (1.0, 2.0, -0.5)
POINT = (0.3, 0.1, 0.0)
PUSHED = sp.PositionMotor(lambda t: 0.3 + t, stiffness=40.0, damping=2.0)


def potential_of(joints, noise=0.05, obstacles=()):
    """The energy with multipliers that are not zero, at positions off the joints."""
    first = sp.RigidBody("a", BOX, density=500.0, stiffness=1e5)
    second = sp.RigidBody("b", BOX, density=900.0, stiffness=1e5, position=(0.5, 0, 0), rotation=(0.2, 0.5, -0.3))
    scene = sp.Scene([first, second], joints=joints, obstacles=obstacles)
    system, start = build_system(scene), initial_state(scene)
    step = JointStep.of(JointGeometry.of(system), start, (0.0, 0.02), 4e-4)
    rng = np.random.default_rng(1)
    x = start.positions + noise * rng.normal(size=start.positions.shape)
    assert step.update(x)
    return step.potential, x + noise * rng.normal(size=x.shape)


JOINTS = {
    "fixed": [sp.FixedJoint("a", "b")],
    "ball": [sp.BallJoint("a", point=POINT)],
    "hinge": [sp.HingeJoint("a", "b", point=POINT, axis=AXIS, limits=(-1e-3, 1e-3), motor=PUSHED)],
    "slider": [sp.SliderJoint("a", "b", point=POINT, axis=AXIS, motor=PUSHED), sp.SliderJoint("b", axis=AXIS)],
    "limited ball": [
        sp.BallJoint("a", "b", point=POINT, axis=AXIS, max_swing=0.05, twist_limits=(-1e-3, 1e-3)),
    ],
    "universal": [sp.UniversalJoint("a", "b", point=POINT, axis=AXIS, second_axis=(2, -1, 0), max_swing=0.05)],
    "obstacle": [sp.HingeJoint("a", "wheel", point=POINT, axis=AXIS, motor=sp.VelocityMotor(3.0))],
}
WHEEL = sp.obstacles.Sphere(radius=0.1, center=(5, 0, 0), name="wheel", motion=sp.Keyframes([0, 1], angles=[0, 5]))


# Control points of the two bodies.
BODIES = np.arange(8).reshape(2, 4)


@pytest.mark.parametrize("kind", JOINTS)
def test_derivatives_are_those_of_the_energy(kind):
    """Taylor's remainders have the slopes 2 for gradient and Hessian alike."""
    energy, x = potential_of(JOINTS[kind], obstacles=[WHEEL] if kind == "obstacle" else ())
    along = 0.1 * np.random.default_rng(2).normal(size=x.shape)
    product = hessian_product(energy, BODIES, x, along)
    assert_derivatives(energy, product, x, along, 1e-3)
    # The energies of the first two are quadratic.
    remainder = np.abs(differences(energy, x, along, 1e-3)[1] - product).max()
    assert (kind in ("fixed", "ball")) == (remainder < 1e-7 * np.abs(product).max())


@pytest.mark.parametrize("kind", ["hinge", "slider", "limited ball"])
def test_the_projected_hessian_is_positive_semidefinite_and_near_the_true_one(kind):
    energy, x = potential_of(JOINTS[kind])
    found = {}
    for project in (False, True):
        blocks = HessianBlocks.zeros(2, len(x))
        energy.add_hessian(x, blocks, project=project)
        columns = []
        for k in range(x.size):
            unit, out = np.zeros(x.size), np.zeros_like(x)
            unit[k] = 1.0
            for coupling in blocks.couplings:
                coupling.add_product(unit.reshape(x.shape), out)
            columns.append(out.ravel())
        found[project] = np.array(columns)
        np.testing.assert_allclose(found[project], found[project].T, atol=1e-9 * np.abs(found[project]).max())
    true, projected = (np.linalg.eigvalsh(found[key]) for key in (False, True))
    assert projected.min() > -1e-9 * projected.max()
    assert true.min() < -1e-6 * true.max()


@pytest.mark.parametrize("kind", ["fixed", "hinge", "slider", "limited ball"])
def test_forces_of_a_joint_are_those_of_its_energy_and_have_no_sum(kind):
    energy, x = potential_of(JOINTS[kind][:1])
    gradient = np.zeros_like(x)
    energy.add_gradient(x, gradient)
    (force,), (torque,) = energy.actions(x)
    on_a = -gradient[:4]
    np.testing.assert_allclose(force, on_a.sum(axis=0), rtol=1e-10)
    np.testing.assert_allclose(gradient.sum(axis=0), 0.0, atol=1e-9 * np.abs(gradient).max())
    if kind == "fixed":  # its point is the center
        np.testing.assert_allclose(torque, np.cross(x[:4] - x[:4].mean(axis=0), on_a).sum(axis=0), rtol=1e-8)


def test_laws_are_lines_that_are_cut_off():
    laws = Laws.of([Law(0, 2.0, -3.0, 5.0, step=1.0, given=0.5), Law(0, 0.0, given=4.0)])
    begin_step(laws.table, laws.step[0], laws.given[0], np.zeros(1))
    multipliers = laws.table["multiplier"]
    g = np.linspace(-4.0, 6.0, 2001)
    efforts = np.array([laws.efforts(np.full(2, value), multipliers) for value in g])
    energies = np.array([laws.energies(np.full(2, value), multipliers) for value in g])
    assert (efforts[:, 0].min(), efforts[:, 0].max()) == (-3.0, 5.0)
    np.testing.assert_allclose(np.gradient(energies, g, axis=0)[1:-1], efforts[1:-1], atol=6e-3)
    assert laws.stiffness(np.zeros(2), multipliers).tolist() == [2.0, 0.0]
    assert laws.stiffness(np.full(2, 6.0), multipliers).tolist() == [0.0, 0.0]
