"""Muscles: derivatives, isometric force in both solvers, momentum, and what is refused."""

import numpy as np
import pytest
from tests.derivatives import derivative_errors, hessian_product

import supple as sp
from supple.model.system import build_system
from supple.solvers.implicit.energies.loads.actuators import muscles_at

E, NU, RHO = 1e5, 0.3, 1000.0
RUBBER = sp.StableNeoHookean(youngs=E, poisson=NU, density=RHO, damping=0.1)
BAR = sp.shapes.box((0.4, 0.2, 0.2), (4, 2, 2))
AREA = 0.04
STILL = {"gravity": (0.0, 0.0, 0.0)}
CURVE = ([0.6, 0.9, 1.1, 1.6], [0.0, 1.0, 1.0, 0.2])


def bar(**changes):
    return sp.Body("bar", BAR, RUBBER, **changes)


@pytest.mark.parametrize("curve", [None, CURVE], ids=["constant", "force-length"])
def test_gradients_and_hessians_have_slope_two(curve):
    muscle = sp.Muscle("bar", 2e4, (1, 2, 0), 0.7, tets=np.arange(5, 60), force_length=curve)
    system = build_system(sp.Scene([sp.Body("first", BAR, RUBBER, position=(0, 1, 0)), bar()], loads=[muscle]))
    rng = np.random.default_rng(0)
    x = 1.23 * system.start_states[0].positions + 0.002 * rng.normal(size=system.rest_positions.shape)
    d = rng.normal(size=x.shape)
    (potential,) = muscles_at(system, 0.0)

    def product(project):
        return hessian_product(potential, system.tets, x, d, project)

    errors, _ = derivative_errors(potential, system.tets, x, d, (2e-4, 1e-4))
    for coarse, fine in zip(*errors, strict=True):
        assert fine < 1e-3
        assert fine < 0.3 * coarse or fine < 1e-8
    # The falling side of the curve is not convex; projection leaves what is.
    assert float((product(True) * d).sum()) > 0.0
    assert np.array_equal(product(True), product(False)) == (curve is None)


SOLVERS = {"implicit": sp.Implicit(tolerance=1e-6, contact=None), "xpbd": sp.XPBD(substeps=30, contact=None)}
ENDS = [
    sp.Pin("bar", sp.InBox((-0.21, -1, -1), (-0.19, 1, 1)), name="left"),
    sp.Pin("bar", sp.InBox((0.19, -1, -1), (0.21, 1, 1)), name="right"),
]


@pytest.mark.parametrize("name", SOLVERS)
def test_the_isometric_force_is_activation_times_strength_times_area(name):
    strength, activation = 3e4, sp.Curve([0.0, 0.05], [0.0, 0.6])
    muscle = sp.Muscle("bar", strength, (1, 0, 0), activation, force_length=([0.5, 1.0, 1.5], [0.0, 1.0, 0.0]))
    scene = sp.Scene([bar()], pins=ENDS, loads=[muscle], **STILL)
    *_, frame = sp.simulate(scene, SOLVERS[name], dt=0.02, steps=10)
    assert frame.report.status == "converged"
    expected = 0.6 * strength * AREA
    left, right = (frame.reactions[pin.label] for pin in ENDS)
    np.testing.assert_allclose(left, [-expected, 0, 0], atol=0.01 * expected)
    np.testing.assert_allclose(right, [expected, 0, 0], atol=0.01 * expected)
    # The bar is not strained: its stress is that of the fibres alone.
    np.testing.assert_allclose(frame.stress["bar"][:, 0, 0], 0.6 * strength, rtol=0.01)
    np.testing.assert_allclose(frame.von_mises["bar"], 0.6 * strength, rtol=0.02)


@pytest.mark.parametrize("name", SOLVERS)
def test_a_free_muscle_shortens_to_its_equilibrium_and_keeps_its_momentum(name):
    strength = 2e4
    frames = list(
        sp.simulate(
            sp.Scene([bar(velocity=(0.1, 0, 0))], loads=[sp.Muscle("bar", strength, (1, 0, 0))], **STILL),
            SOLVERS[name],
            dt=0.02,
            steps=40,
        )
    )
    last = frames[-1]
    # The elastic stress balances that of the fibres, in every tet alike: the stress in all is zero.
    np.testing.assert_allclose(last.first_piola["bar"][:, 0, 0], 0.0, atol=0.02 * strength)
    assert np.ptp(last.positions["bar"][:, 0]) < 0.9 * 0.4
    mass = last.system.masses.sum()
    moving = max(last.system.masses @ np.linalg.norm(frame.state.velocities, axis=1) for frame in frames)
    for frame in frames:
        np.testing.assert_allclose(frame.report.linear_momentum, [0.1 * mass, 0, 0], atol=1e-9 * mass)
        # Backward Euler itself conserves angular momentum only up to the first order of the step.
        error = 1e-3 if name == "implicit" else 1e-9
        assert np.abs(frame.report.angular_momentum).max() < error * 0.4 * moving


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: sp.Muscle("bar", -1.0, (1, 0, 0)), "muscle on body 'bar': strength is -1; it must be above zero"),
        (lambda: sp.Muscle("bar", 1.0, (0, 0, 0)), "direction is zero or not finite"),
        (lambda: sp.Muscle("bar", 1.0, (1, 0)), "direction has shape .2,.; give .3,., or .m, 3."),
        (lambda: sp.Muscle("bar", 1.0, np.ones((2, 3))), "there are 2 directions for 96 tets"),
        (lambda: sp.Muscle("bar", 1.0, (1, 0, 0), 1.1), "activation is 1.1; it must be from 0 to 1"),
        (lambda: sp.Muscle("bar", 1.0, (1, 0, 0), -0.1), "activation is -0.1; it must be from 0 to 1"),
        (lambda: sp.Muscle("bar", 1.0, (1, 0, 0), tets=[999]), "tet 999 does not exist; the body has 96"),
        (lambda: sp.Muscle("bar", 1.0, (1, 0, 0), tets=[1, 1]), "names a tet twice"),
        (lambda: sp.Muscle("bar", 1.0, (1, 0, 0), tets=[]), "must be a non-empty list"),
        (lambda: sp.Muscle("bar", 1.0, (1, 0, 0), tets=sp.InBox((5, 5, 5), (6, 6, 6))), "its box holds no tet"),
        (lambda: sp.Muscle("bar", 1.0, (1, 0, 0), force_length=([1, 0.5], [1, 1])), "stretches must be finite, above"),
        (lambda: sp.Muscle("bar", 1.0, (1, 0, 0), force_length=([1.0], [-1.0])), "values must be finite and zero or"),
        (lambda: sp.Muscle("bar", 1.0, (1, 0, 0), force_length=3.0), "force_length is 3.0; give .stretches, values."),
        (lambda: sp.Muscle("rigid", 1.0, (1, 0, 0)), "body 'rigid' is rigid; a muscle acts in soft bodies"),
        (lambda: sp.Muscle("rod", 1.0, (1, 0, 0)), "body 'rod' does not exist"),
    ],
)
def test_bad_muscles_are_one_line(make, message):
    with pytest.raises(sp.SceneError, match=message):
        sp.Scene([bar(), sp.RigidBody("rigid", BAR, density=1, position=(1, 0, 0))], loads=[make()])


def test_activations_are_checked_when_they_are_called():
    scene = sp.Scene([bar()], loads=[sp.Muscle("bar", 1.0, (1, 0, 0), lambda t: 2.0)])
    with pytest.raises(sp.SceneError, match=r"activation\(0\) is 2; it must be from 0 to 1"):
        list(sp.simulate(scene, sp.XPBD(substeps=1), dt=0.01, steps=1))
