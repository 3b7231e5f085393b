"""Energies of one's own: the same numbers as the built-in ones, a material that is not built in, and clear errors."""

import math
import sys

import h5py
import numpy as np
import pytest
import sympy
from tests.recordings import set_in_scene

import supple as sp
from supple.errors import OutputError, SceneError
from supple.materials.own.energy_material import FormulaLaw

BULK = 4e6
MESH = sp.shapes.box((0.3, 0.2, 0.2), (2, 1, 1))


def mooney(I1, I2, J, c10, c01):
    return c10 * I1 * J ** sympy.Rational(-2, 3) + c01 * I2 * J ** sympy.Rational(-4, 3)


def ogden(s0, s1, s2, mu, alpha):
    return mu / alpha * ((s0**alpha + s1**alpha + s2**alpha) * (s0 * s1 * s2) ** (-alpha / 3))


def gent(I1, I2, J, mu, limit):
    return -mu * limit / 2 * sympy.log(1 - (I1 * J ** sympy.Rational(-2, 3) - 3) / limit)


# Made in tests, not while pytest collects them: a law of one's own is compiled where it is made.
KINDS = ["invariants", "stretches"]


def pair(of):
    """An energy of one's own, and the built-in material that it is."""
    if of == "invariants":
        own = sp.EnergyMaterial(psi=mooney, parameters={"c10": 1e5, "c01": 3e4}, bulk=BULK)
        return own, sp.MooneyRivlin(c10=1e5, c01=3e4, bulk=BULK)
    own = sp.EnergyMaterial(psi=ogden, of="stretches", parameters={"mu": 6e5, "alpha": 1.3}, bulk=BULK)
    return own, sp.Ogden(mu=[6e5], alpha=[1.3], bulk=BULK)


@pytest.mark.parametrize("of", KINDS)
def test_the_numbers_are_those_of_the_built_in_materials(of):
    own, known = pair(of)
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
    material = sp.EnergyMaterial(psi=gent, parameters={"mu": 2e5, "limit": 20.0}, bulk=BULK)
    for stretch in (0.6, 1.3, 2.5, 4.0):
        s = np.array([stretch, stretch**-0.5, stretch**-0.5])
        P = np.diag(material.first_piola(np.diag(s)))
        I1 = (s**2).sum()
        exact = 2e5 * 20.0 / (20.0 - (I1 - 3)) * (stretch - stretch**-2)
        assert P[0] - P[1] * s[1] / s[0] == pytest.approx(exact, rel=1e-6)
    rng = np.random.default_rng(2)
    F, dF = np.eye(3) + 0.2 * rng.normal(size=(3, 3)), rng.normal(size=(3, 3))
    P, H = material.first_piola(F), material.hessian(F)
    slopes, curvatures = [], []
    for h in (2e-3, 1e-3):
        plus, minus = F + h * dF, F - h * dF
        slopes.append(abs((material.energy_density(plus) - material.energy_density(minus)) / (2 * h) - (P * dF).sum()))
        change = (material.first_piola(plus) - material.first_piola(minus)).ravel() / (2 * h)
        curvatures.append(np.abs(change - H @ dF.ravel()).max())
    assert math.log2(slopes[0] / slopes[1]) == pytest.approx(2.0, abs=0.1)
    assert math.log2(curvatures[0] / curvatures[1]) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("order", [1, 2])
def test_a_body_is_simulated_like_one_of_the_built_in_material(order, tmp_path):
    mesh = MESH.to_order(order)
    c10 = np.linspace(1e5, 2e5, len(MESH.tets))
    own = sp.EnergyMaterial(psi=mooney, parameters={"c10": c10, "c01": 3e4}, bulk=BULK)
    x = mesh.vertices[:, 0]
    pins = [sp.Pin("b", (x == x.min()).nonzero()[0])]
    pins.append(sp.Pin("b", (x == x.max()).nonzero()[0], motion=lambda t: (0.1 * t, 0.02 * t, 0)))
    ends = []
    for material in (own, sp.MooneyRivlin(c10=c10, c01=3e4, bulk=BULK)):
        scene = sp.Scene([sp.Body("b", mesh, material)], pins=pins)
        solver = sp.Implicit(integrator="static", contact=None)
        sink = sp.Recorder(tmp_path / "r.vtkhdf")
        (frame,) = sp.simulate(scene, solver, dt=1.0, steps=1, sinks=[sink])
        assert frame.report.status == "converged"
        ends.append(frame)
        if material is own:
            with sp.read_recording(sink.path) as recording:
                scale = np.abs(frame.stress["b"]).max()
                np.testing.assert_allclose(recording[-1].stress["b"], frame.stress["b"], atol=1e-9 * scale)
                of_frame, recorded = frame.energy_density["b"], recording[-1].energy_density["b"]
                np.testing.assert_allclose(recorded, of_frame, atol=1e-9 * of_frame.max())
            assert sp.check_recording(sink.path).ok
    np.testing.assert_allclose(ends[0].positions["b"], ends[1].positions["b"], atol=1e-9)
    np.testing.assert_allclose(ends[0].stress["b"], ends[1].stress["b"], atol=1e-3)


TEXTS = {
    "invariants": "c10 * I1 * J**(-2/3) + c01 * I2 * J**(-4/3)",
    "stretches": "mu / alpha * (s0**alpha + s1**alpha + s2**alpha) * (s0*s1*s2)**(-alpha/3)",
}


@pytest.mark.parametrize("of", KINDS)
def test_a_formula_as_text_is_that_of_the_function_and_is_evaluated_without_sympy(of):
    own, known = pair(of)
    """The law of recordings against the built-in one, the formula that is written against the one that is given."""
    F = np.eye(3) + 0.25 * np.random.default_rng(0).normal(size=(100, 3, 3))
    F = F[np.linalg.det(F) > 0.1]
    rows = np.column_stack([np.broadcast_to(value, len(F)) for value in (BULK, *own.parameters.values())])
    exact = known.energy_density(F), known.first_piola(F)
    formula = own.law().formula
    assert formula is not None
    law = FormulaLaw(formula)
    psi, P, _ = law.models(F, rows, False, False)
    for value, right in zip((psi, P), exact, strict=True):
        np.testing.assert_allclose(value, right, atol=1e-11 * np.abs(right).max(), rtol=0)
    np.testing.assert_array_equal(law.densities(F, rows), psi)
    flat = np.array([np.diag([1.0, 1.0, J]) for J in (0.0, -1.0)])
    assert np.isinf(law.densities(flat, rows[:2])).all()
    text = sp.EnergyMaterial(psi=f" {TEXTS[own.of]} ", of=own.of, parameters=own.parameters, bulk=BULK)
    assert text.law() is own.law()


def test_texts_keep_every_digit_and_what_they_cannot_hold_is_not_recorded():
    def exact(I1, I2, J):
        return 1.2345678901234567e5 * (I1 * J ** sympy.Rational(-2, 3) - 3)

    def bent(I1, I2, J):
        I1_bar = I1 * J ** sympy.Rational(-2, 3)
        return 1e5 * sympy.Piecewise((I1_bar - 3, I1_bar < 4), (2 * I1_bar - 7, True))

    formula = sp.EnergyMaterial(psi=exact, bulk=1e6).law().formula
    assert formula is not None
    assert "123456.78901234567" in formula.text
    assert sp.EnergyMaterial(psi=bent, bulk=1e6).law().formula is None


@pytest.mark.parametrize(
    ("of", "text"),
    [
        ("invariants", "mu/2 * (I1 - 3 - 2*log(J)) + lam/2 * log(J)**2"),
        ("stretches", "mu/2 * (s0**2 + s1**2 + s2**2 - 3 - 2*log(s0*s1*s2)) + lam/2 * log(s0*s1*s2)**2"),
    ],
)
def test_moduli_of_small_strains_are_those_of_psi_and_of_the_bulk_together(of, text):
    mu, lam = np.array([1e5, 2e5, 1e5]), 3e5
    own = sp.EnergyMaterial(psi=text, of=of, parameters={"mu": mu, "lam": lam}, bulk=4e5)
    found = np.array(own.rest_moduli())
    np.testing.assert_allclose(found, [mu, lam + 2 * mu / 3 + 4e5], rtol=1e-12)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("__import__('os').system('touch hacked')", "use numbers, names"),
        ("I1.__class__", "use numbers, names"),
        ("(lambda: I1)()", "use numbers, names"),
        ("[I1 for x in (1,)][0]", "use numbers, names"),
        ("exp(I1, J)", "use numbers, names"),
        ("open(J)", "use numbers, names"),
        ("f(" + "-" * 1500 + "J)", "use numbers, names|cannot be read"),
        ("I1\n+ J", "cannot be read"),
        ("J if I1 else I2", "use numbers, names"),
        ("'a' * 9", "use numbers, names"),
        ("I1 + x", "the unknown name 'x'; there are I1, I2, J"),
        ("I1 +", "cannot be read"),
        ("9**9**9**9 * I1", "a number that is not finite"),
        ("1.5e308 * 10 + I1", "a number that is not finite"),
        ("log(0) + I1", "a number that is not finite"),
        ("(-2)**0.5 * I1", "a number that is not finite"),
        ("I1**(10**9)", "exponent 1e[+]09; give one up to 100"),
        ("(" * 150 + "I1" + ")" * 150 + "+1" * 250, "nested too deeply"),
        ("-" * 3000 + "I1", "nested too deeply|cannot be read"),
        ("I1" * 3000, "6000 characters; give at most 4000"),
    ],
)
def test_texts_that_are_no_formulas_are_refused_and_nothing_is_executed(text, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SceneError, match=message) as error:
        sp.EnergyMaterial(psi=text)
    assert str(error.value).startswith("EnergyMaterial: ")
    assert not list(tmp_path.iterdir())


def test_a_recording_with_a_hostile_formula_is_refused(tmp_path):
    x = MESH.vertices[:, 0]
    own, _ = pair("invariants")
    scene = sp.Scene([sp.Body("b", MESH, own)], pins=[sp.Pin("b", (x == x.min()).nonzero()[0])])
    path = tmp_path / "r.vtkhdf"
    list(sp.simulate(scene, sp.Implicit(contact=None), dt=0.01, steps=1, sinks=[sp.Recorder(path)]))
    with h5py.File(path, "r+") as file:
        set_in_scene(file, "scene/bodies/0/material/psi/text", "__import__('os').system('touch hacked')")
    with pytest.raises(OutputError, match=r"is damaged: its description of the scene: the formula has \"__import__"):
        sp.read_recording(path)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"psi": lambda I1, I2, J: np.exp(I1)}, r"psi cannot be called with symbols \(.*\); use \+, -,"),
        ({"psi": lambda I1, I2: I1}, "psi cannot be called with symbols"),
        ({"psi": lambda I1, I2, J: 1e5 * I1}, r"psi has a stress of 200000 Pa at rest; add a term that cancels it"),
        ({"psi": lambda s0, s1, s2: (s0 - 1) ** 2 + s1**2 - 2 * s1, "of": "stretches"}, "psi is not symmetric"),
        (
            {"psi": lambda I1, I2, J: -mooney(I1, I2, J, 1e5, 0), "bulk": 1e6},
            "the shear modulus at rest, that of psi, is",
        ),
        ({"psi": gent, "parameters": {"mu": "a", "limit": 1.0}}, "the parameter 'mu' is 'a'; give finite numbers"),
        ({"psi": gent, "parameters": {"mu": 1.0, "limit": 1.0}, "of": "strains"}, "of is 'strains'; give 'invariants'"),
        ({"psi": 3.0}, "psi is a float; give a formula or a function"),
    ],
)
def test_what_is_no_energy_is_one_clear_line(arguments, message):
    with pytest.raises(SceneError, match=f"^EnergyMaterial: {message}"):
        sp.EnergyMaterial(**arguments)


def test_without_sympy_the_error_names_the_install_command(monkeypatch):
    monkeypatch.setitem(sys.modules, "sympy", None)
    with pytest.raises(SceneError, match=r"needs SymPy, which is not installed; pip install 'supple\[symbolic\]'$"):
        sp.EnergyMaterial(psi="mu / 2 * (I1 - 3)", parameters={"mu": 1e4}, density=1000.0)
