"""Materials that flow in quadratic tets: internal variables at each of their points."""

import numpy as np
import pytest
from tests.derivatives import differences, gradient_of, hessian_product

import supple as sp
from supple.materials.laws.internal import at_rest, count_of
from supple.model.system import build_system
from supple.solvers.implicit.energies.elasticity import elasticity_of

STATIC = sp.Implicit(integrator="static", contact=None)
RUBBER = sp.MooneyRivlin(c10=8e4, c01=2e4, bulk=1e7)
SLOW = sp.Viscoelastic(material=RUBBER, prony=[(0.3, 0.1), (0.2, 1.0)])
METAL = sp.J2Plastic(youngs=2e11, poisson=0.3, yield_stress=2e8, hardening=1e9)
NAMES = ("linear", "quadratic")


def test_a_uniform_motion_has_the_stress_and_the_flow_of_linear_tets():
    cube = sp.shapes.box((1, 1, 1), (1, 1, 1))
    for material, size in ((SLOW, 0.4), (METAL, 0.004)):
        bodies, pins = [], []
        for name, mesh in zip(NAMES, (cube, cube.to_order(2)), strict=True):
            bodies.append(sp.Body(name, mesh, material))
            for i, x in enumerate(mesh.vertices):
                share = np.array([1.0, -0.5, -0.5]) * size

                def move(t, x=x, share=share):
                    return np.expm1(share * np.sin(3.0 * t)) * x

                pins.append(sp.Pin(name, [i], motion=move))
        for frame in sp.simulate(sp.Scene(bodies, pins=pins, gravity=(0, 0, 0)), STATIC, dt=0.2, steps=5):
            one, two = (frame.stress[name] for name in NAMES)
            np.testing.assert_allclose(two, one, atol=1e-9 * np.abs(one).max())
            for of in (frame.dissipated_energy, frame.energy_density):
                assert of["linear"].min() > 0.0
                np.testing.assert_allclose(of["quadratic"], of["linear"], rtol=1e-6)
        assert len(frame.state.internal) == 5 * count_of(material.per_tet(len(cube.tets)))


def test_the_energy_of_a_step_has_the_derivatives_of_differences():
    """Of three materials in quadratic tets, behind a body of linear ones that flows."""
    mesh = sp.shapes.box((0.3, 0.2, 0.2), (1, 1, 1), order=2)
    parts = [SLOW, METAL, sp.NeoHookean(youngs=1e5, poisson=0.3)]
    mixed = sp.Regions(materials=parts, index=np.arange(len(mesh.tets)) % 3)
    linear = sp.Body("linear", sp.shapes.box((1, 1, 1), (1, 1, 1)), SLOW)
    system = build_system(sp.Scene([linear, sp.Body("quadratic", mesh, mixed, position=(3, 0, 0))]))
    rng, rest = np.random.default_rng(0), system.rest_positions
    whole = elasticity_of(system)
    first = rest @ (np.eye(3) + 0.05 * rng.normal(size=(3, 3))).T
    internal = whole.flowed(first, at_rest(count_of(system.laws.material)), 0.05)
    assert (internal[:, 9] > 0.0).all()
    step = whole.in_step(internal, 0.1)
    x = first + 0.003 * rng.normal(size=first.shape)
    d, t = rng.normal(size=x.shape), 1e-5

    force, exact = gradient_of(step, x), hessian_product(step, system.tets, x, d)
    change, bend = differences(step, x, d, t)
    assert change == pytest.approx((force * d).sum(), rel=1e-5)
    np.testing.assert_allclose(bend, exact, atol=1e-5 * np.abs(exact).max())
    # The forces at the end are those of the stress of the state after the step.
    held = gradient_of(whole.in_step(whole.flowed(x, internal, 0.1), 0.0), x)
    np.testing.assert_allclose(held, force, atol=1e-9 * np.abs(force).max())
