"""Energies of one's own: the same numbers as the built-in ones, a material that is not built in, and clear errors."""

import math

import numpy as np
import pytest
import sympy

import supple as sp
from supple.errors import SceneError

BULK = 4e6
MESH = sp.shapes.box((0.3, 0.2, 0.2), (2, 1, 1))


def mooney(I1, I2, J, c10, c01):
    return c10 * I1 * J ** sympy.Rational(-2, 3) + c01 * I2 * J ** sympy.Rational(-4, 3)


def ogden(s0, s1, s2, mu, alpha):
    return mu / alpha * ((s0**alpha + s1**alpha + s2**alpha) * (s0 * s1 * s2) ** (-alpha / 3))


def gent(I1, I2, J, mu, limit):
    return -mu * limit / 2 * sympy.log(1 - (I1 * J ** sympy.Rational(-2, 3) - 3) / limit)


PAIRS = [
    (
        sp.EnergyMaterial(psi=mooney, parameters={"c10": 1e5, "c01": 3e4}, bulk=BULK),
        sp.MooneyRivlin(c10=1e5, c01=3e4, bulk=BULK),
    ),
    (
        sp.EnergyMaterial(psi=ogden, of="stretches", parameters={"mu": 6e5, "alpha": 1.3}, bulk=BULK),
        sp.Ogden(mu=[6e5], alpha=[1.3], bulk=BULK),
    ),
]
GENT = sp.EnergyMaterial(psi=gent, parameters={"mu": 2e5, "limit": 20.0}, bulk=BULK)


@pytest.mark.parametrize(("own", "known"), PAIRS, ids=["invariants", "stretches"])
def test_the_numbers_are_those_of_the_built_in_materials(own, known):
    rng = np.random.default_rng(0)
    F = np.eye(3) + 0.25 * rng.normal(size=(100, 3, 3))
    F = F[np.linalg.det(F) > 0.1]
    equal = np.array([np.eye(3), 1.2 * np.eye(3)])
    # Two stretches that are equal, nearly so, and on both sides of where the quotient is taken in another way.
    near = [np.diag([1.2, 1.2 * np.exp(apart), 0.9]) for apart in (0.0, 1e-7, 0.0199, 0.0201)]
    F = np.concatenate([F, equal, near])
    for name in ("energy_density", "first_piola", "hessian"):
        exact = getattr(known, name)(F)
        np.testing.assert_allclose(getattr(own, name)(F), exact, atol=1e-11 * np.abs(exact).max(), rtol=0)
    projected = known.hessian(F, project=True)
    np.testing.assert_allclose(own.hessian(F, project=True), projected, atol=1e-11 * np.abs(projected).max(), rtol=0)
    assert own.youngs == pytest.approx(known.youngs, rel=1e-12)
    assert own.energy_density(np.eye(3)) == pytest.approx(0.0, abs=1e-9)


def test_gents_rubber_has_its_closed_form_and_an_order_of_two():
    for stretch in (0.6, 1.3, 2.5, 4.0):
        s = np.array([stretch, stretch**-0.5, stretch**-0.5])
        P = np.diag(GENT.first_piola(np.diag(s)))
        I1 = (s**2).sum()
        exact = 2e5 * 20.0 / (20.0 - (I1 - 3)) * (stretch - stretch**-2)
        assert P[0] - P[1] * s[1] / s[0] == pytest.approx(exact, rel=1e-6)
    rng = np.random.default_rng(2)
    F, dF = np.eye(3) + 0.2 * rng.normal(size=(3, 3)), rng.normal(size=(3, 3))
    P, H = GENT.first_piola(F), GENT.hessian(F)
    slopes, curvatures = [], []
    for h in (2e-3, 1e-3):
        plus, minus = F + h * dF, F - h * dF
        slopes.append(abs((GENT.energy_density(plus) - GENT.energy_density(minus)) / (2 * h) - (P * dF).sum()))
        change = (GENT.first_piola(plus) - GENT.first_piola(minus)).ravel() / (2 * h)
        curvatures.append(np.abs(change - H @ dF.ravel()).max())
    assert math.log2(slopes[0] / slopes[1]) == pytest.approx(2.0, abs=0.1)
    assert math.log2(curvatures[0] / curvatures[1]) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("integration", ["tets", "patches"])
def test_a_body_is_simulated_like_one_of_the_built_in_material(integration, tmp_path):
    c10 = np.linspace(1e5, 2e5, len(MESH.tets))
    shared = {"bulk": BULK, "integration": integration}
    own = sp.EnergyMaterial(psi=mooney, parameters={"c10": c10, "c01": 3e4}, **shared)
    x = MESH.vertices[:, 0]
    pins = [sp.Pin("b", (x == x.min()).nonzero()[0])]
    pins.append(sp.Pin("b", (x == x.max()).nonzero()[0], motion=lambda t: (0.1 * t, 0.02 * t, 0)))
    ends = []
    for material in (own, sp.MooneyRivlin(c10=c10, c01=3e4, **shared)):
        scene = sp.Scene([sp.Body("b", MESH, material)], pins=pins)
        solver = sp.Implicit(integrator="static", contact=None)
        sink = sp.Recorder(tmp_path / "r.vtkhdf")
        (frame,) = sp.simulate(scene, solver, dt=1.0, steps=1, sinks=[sink])
        assert frame.report.status == "converged"
        ends.append(frame)
        if material is own:
            with sp.read_recording(sink.path) as recording, pytest.raises(SceneError, match="has no known elastic law"):
                recording[-1].stress["b"]
    np.testing.assert_allclose(ends[0].positions["b"], ends[1].positions["b"], atol=1e-9)
    np.testing.assert_allclose(ends[0].stress["b"], ends[1].stress["b"], atol=1e-3)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"psi": lambda I1, I2, J: np.exp(I1)}, r"psi cannot be called with symbols \(.*\); use \+, -,"),
        ({"psi": lambda I1, I2: I1}, "psi cannot be called with symbols"),
        ({"psi": lambda I1, I2, J: 1e5 * I1}, r"psi has a stress of 200000 Pa at rest; add a term that takes it away"),
        ({"psi": lambda s0, s1, s2: (s0 - 1) ** 2 + s1**2 - 2 * s1, "of": "stretches"}, "psi is not symmetric"),
        (
            {"psi": lambda I1, I2, J: -mooney(I1, I2, J, 1e5, 0), "bulk": 1e6},
            "the shear modulus at rest, that of psi, is",
        ),
        ({"psi": gent, "parameters": {"mu": "a", "limit": 1.0}}, "the parameter 'mu' is 'a'; give finite numbers"),
        ({"psi": gent, "parameters": {"mu": 1.0, "limit": 1.0}, "of": "strains"}, "of is 'strains'; give 'invariants'"),
        ({"psi": 3.0}, "psi is a float; give a function"),
        (
            {"psi": gent, "parameters": {"mu": 1e5, "limit": 20.0}, "integration": "patches"},
            "integration='patches' needs a bulk above zero",
        ),
    ],
)
def test_what_is_no_energy_is_one_clear_line(arguments, message):
    with pytest.raises(SceneError, match=f"^EnergyMaterial: {message}"):
        sp.EnergyMaterial(**arguments)
