"""Mooney-Rivlin, Yeoh and Ogden: closed forms, finite differences, projection, and whole bodies of them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.derivatives import differences, gradient_of, hessian_product

import supple as sp
from supple.errors import SceneError, SolverError
from supple.model.system import build_system
from supple.results.check.recorded import RecordedTrajectory
from supple.solvers.implicit.energies.elasticity import elasticity_of

MOONEY = sp.MooneyRivlin(c10=1e5, c01=3e4, bulk=4e6)
YEOH = sp.Yeoh(c10=1e5, c20=-1e3, c30=120.0, bulk=4e6)
OGDEN = sp.Ogden(mu=[6.3e5, 1.2e3, -1e4], alpha=[1.3, 5.0, -2.0], bulk=4e6)
RUBBERS = [pytest.param(material, id=type(material).__name__) for material in (MOONEY, YEOH, OGDEN)]
MESH = sp.shapes.box((0.3, 0.2, 0.2), (2, 1, 1))


def energy_of_stretches(material, s):
    """The formulas of the classes, as they are printed."""
    J = np.prod(s)
    t = np.asarray(s) * J ** (-1 / 3)
    volume = 0.5 * material.bulk * (J - 1) ** 2
    I1, I2 = (t**2).sum(), (t**-2).sum()
    if isinstance(material, sp.MooneyRivlin):
        return material.c10 * (I1 - 3) + material.c01 * (I2 - 3) + volume
    if isinstance(material, sp.Yeoh):
        return material.c10 * (I1 - 3) + material.c20 * (I1 - 3) ** 2 + material.c30 * (I1 - 3) ** 3 + volume
    return sum(mu / a * ((t**a).sum() - 3) for mu, a in zip(material.mu, material.alpha, strict=True)) + volume


def nominal_stress(material, stretch, lateral):
    """d W / d stretch of the incompressible material with stretches (l, l^lateral, l^(-1 - lateral))."""
    l, b = stretch, lateral  # noqa: E741
    s, powers = np.array([l, l**b, l ** (-1 - b)]), np.array([1.0, b, -1 - b])
    I1 = (s**2).sum()
    if isinstance(material, sp.MooneyRivlin):
        return (2 * material.c10 * powers * s**2 - 2 * material.c01 * powers * s**-2).sum() / l
    if isinstance(material, sp.Yeoh):
        slope = material.c10 + 2 * material.c20 * (I1 - 3) + 3 * material.c30 * (I1 - 3) ** 2
        return slope * (2 * powers * s**2).sum() / l
    return sum((mu * powers * s**a).sum() for mu, a in zip(material.mu, material.alpha, strict=True)) / l


@pytest.mark.parametrize("material", RUBBERS)
@pytest.mark.parametrize("lateral", [-0.5, 1.0, 0.0], ids=["uniaxial", "equibiaxial", "pure shear"])
def test_curves_are_the_closed_forms(material, lateral):
    for stretch in (0.5, 0.9, 1.0 + 1e-7, 1.3, 2.0, 4.0):
        powers = np.array([1.0, lateral, -1 - lateral])
        s = stretch**powers
        P = np.diag(material.first_piola(np.diag(s)))
        # The pressure does no work without a change of volume.
        assert (P * powers * s).sum() / stretch == pytest.approx(nominal_stress(material, stretch, lateral), rel=1e-6)


@pytest.mark.parametrize("material", RUBBERS)
def test_simple_shear_and_pressure_are_the_closed_forms(material):
    shear = 0.8
    F = np.array([[1.0, shear, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    cauchy = material.first_piola(F) @ F.T
    l = 0.5 * (shear + np.sqrt(4 + shear**2))  # noqa: E741
    # The principal stretches are l, 1 and 1/l, and d l / d shear = l^2 / (1 + l^2).
    exact = nominal_stress(material, l, 0.0) * l**2 / (1 + l**2)
    assert cauchy[0, 1] == pytest.approx(exact, rel=1e-6)
    swollen = material.first_piola(1.1 * np.eye(3)) @ (1.1 * np.eye(3)) / 1.331
    np.testing.assert_allclose(swollen, 4e6 * 0.331 * np.eye(3), rtol=1e-10, atol=1e-4)


@pytest.mark.parametrize("material", RUBBERS)
def test_densities_are_as_printed_and_accurate_near_rest(material):
    rng = np.random.default_rng(4)
    for s in np.exp(rng.normal(0, 0.4, (20, 3))):
        assert material.energy_density(np.diag(s)) == pytest.approx(energy_of_stretches(material, s), rel=1e-9)
    assert material.energy_density(np.eye(3)) == 0.0
    mu, bulk = material.rest_moduli()
    tiny = 1e-7
    F = np.array([[1.0, tiny, 0.0], [tiny, 1.0, 0.0], [0.0, 0.0, 1.0]])
    assert material.energy_density(F) == pytest.approx(2 * mu * tiny**2, rel=1e-5)
    identity = np.eye(3)
    linear = (bulk - 2 * mu / 3) * np.einsum("ij,kl->ijkl", identity, identity) + mu * (
        np.einsum("ik,jl->ijkl", identity, identity) + np.einsum("il,jk->ijkl", identity, identity)
    )
    np.testing.assert_allclose(material.hessian(identity), linear.reshape(9, 9), atol=1e-12 * bulk)
    np.testing.assert_allclose(material.youngs, 9 * bulk * mu / (3 * bulk + mu))


def order(approximation, exact, width):
    errors = [np.abs(approximation(h) - exact).max() for h in (width, width / 2)]
    return np.log2(errors[0] / errors[1])


@pytest.mark.parametrize("material", RUBBERS)
@settings(max_examples=8, deadline=None)
@given(st.integers(0, 2**31))
def test_derivatives_have_slope_two_and_the_projection_is_the_nearest(material, seed):
    rng = np.random.default_rng(seed)
    U, V = (np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(2))
    s = np.exp(rng.uniform(-0.6, 0.6, 3))
    s[1] = s[0] if seed % 3 == 0 else s[1]  # stretches that are equal
    F = U * s @ V * np.linalg.det(U @ V)
    dF = rng.normal(size=(3, 3))
    dF /= np.linalg.norm(dF)
    P, H = material.first_piola(F), material.hessian(F)
    np.testing.assert_array_equal(H, H.T)
    psi = material.energy_density
    assert order(lambda h: (psi(F + h * dF) - psi(F - h * dF)) / (2 * h), (P * dF).sum(), 4e-3) == pytest.approx(
        2, abs=0.1
    )
    slopes = lambda h: (material.first_piola(F + h * dF) - material.first_piola(F - h * dF)).ravel() / (2 * h)  # noqa: E731
    assert order(slopes, H @ dF.ravel(), 4e-3) == pytest.approx(2.0, abs=0.1)
    w, Q = np.linalg.eigh(H)
    nearest = Q * np.maximum(w, 0.0) @ Q.T
    np.testing.assert_allclose(material.hessian(F, project=True), nearest, atol=1e-12 * np.abs(H).max(), rtol=0)


def test_there_is_no_energy_where_the_volume_is_not_positive():
    assert MOONEY.energy_density(np.diag([1.0, 1.0, -1.0])) == np.inf
    assert np.isnan(MOONEY.first_piola(np.diag([1.0, 1.0, -1.0]))).all()


def bodies():
    """A mesh of all three materials, with a parameter per tet."""
    rubber = {"bulk": 4e6}
    c10 = np.linspace(1e5, 2e5, len(MESH.tets))
    parts = [
        sp.MooneyRivlin(c10=c10, c01=3e4, **rubber),
        sp.Yeoh(c10=1e5, c20=-1e3, c30=120.0, **rubber),
        sp.NeoHookean(youngs=3e5, poisson=0.3),
    ]
    return sp.Regions(materials=parts, index=np.repeat([0, 1, 2], [4, 4, len(MESH.tets) - 8]))


def test_energies_of_bodies_have_slope_two():
    system = build_system(sp.Scene([sp.Body("block", MESH, bodies())]))
    energy = elasticity_of(system)
    rng = np.random.default_rng(3)
    x = MESH.vertices @ (np.eye(3) + 0.2 * rng.normal(size=(3, 3))).T + 0.01 * rng.normal(size=MESH.vertices.shape)
    d = rng.normal(size=x.shape)

    assert energy.energies(x).sum() == pytest.approx(energy.value(x), rel=1e-12)
    along, exact = np.vdot(gradient_of(energy, x), d), hessian_product(energy, system.tets, x, d)
    assert order(lambda h: differences(energy, x, d, h)[0], along, 1e-4) == pytest.approx(2.0, abs=0.1)
    assert order(lambda h: differences(energy, x, d, h)[1], exact, 1e-4) == pytest.approx(2.0, abs=0.1)


def test_a_body_in_equilibrium_is_recorded_with_its_laws(tmp_path):
    x = MESH.vertices[:, 0]
    ends = [(x == x.min()).nonzero()[0], (x == x.max()).nonzero()[0]]
    pins = [sp.Pin("bar", ends[0]), sp.Pin("bar", ends[1], motion=lambda t: (0.1 * t, 0.02 * t, 0.0))]
    scene = sp.Scene([sp.Body("bar", MESH, bodies())], pins=pins)
    sink = sp.Recorder(tmp_path / "r.vtkhdf")
    (frame,) = sp.simulate(scene, sp.Implicit(integrator="static", contact=None), dt=1.0, steps=1, sinks=[sink])
    assert frame.report.status == "converged"
    # The nodal forces of the stresses are those of the solver: weight is what they carry.
    system, P = frame.system, frame.first_piola["bar"]
    forces = np.einsum("e,eij,ekj->eki", -system.rest_volumes, P, system.rest_shape_inverse)
    total = np.zeros_like(frame.positions["bar"])
    np.add.at(total, MESH.tets[:, 1:], forces)
    np.add.at(total, MESH.tets[:, 0], -forces.sum(axis=1))
    free = np.setdiff1d(np.arange(len(x)), np.concatenate(ends))
    weight = system.masses[free, None] * system.gravity
    np.testing.assert_allclose(total[free], -weight, atol=1e-4 * np.abs(total).max())
    with sp.read_recording(sink.path) as recording:
        read, known = recording[-1], RecordedTrajectory(recording)
        np.testing.assert_array_equal(read.stress["bar"], frame.stress["bar"])
        np.testing.assert_array_equal(read.energy_density["bar"], frame.energy_density["bar"])
        assert known.snapshot(read.number).elastic_energy == pytest.approx(frame.report.elastic_energy, rel=1e-12)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: sp.MooneyRivlin(c10=1e5, c01=-2e5, bulk=1e6), r"the shear modulus at rest, 2 \(c10 \+ c01\), is -2"),
        (lambda: sp.MooneyRivlin(c10=1e5, bulk=0.0), "MooneyRivlin: bulk is 0; it must be above zero"),
        (lambda: sp.Yeoh(c10=np.nan, bulk=1e6), "Yeoh: c10 is nan; it must be finite"),
        (lambda: sp.Ogden(mu=[1e5], alpha=[2, 3], bulk=1e6), "Ogden: 1 mu and 2 alpha"),
        (lambda: sp.Ogden(mu=[1e5], alpha=[0.0], bulk=1e6), "Ogden: an alpha is 0"),
        (lambda: sp.Ogden(mu=1e5, alpha=[2.0], bulk=1e6), "Ogden: mu is 100000.0; give a list"),  # pyright: ignore[reportArgumentType]
    ],
)  # fmt: skip
def test_bad_parameters_are_one_clear_line(make, message):
    with pytest.raises(SceneError, match=message):
        make()


def test_xpbd_and_inverted_starts_are_refused():
    scene = sp.Scene([sp.Body("block", MESH, MOONEY)])
    with pytest.raises(SolverError, match=r"^XPBD: body 'block' has the material MooneyRivlin, which XPBD cannot"):
        next(sp.simulate(scene, sp.XPBD(contact=None), dt=0.01, steps=1))
    mirrored = {"block": MESH.vertices * [1, 1, -1]}
    with pytest.raises(SolverError, match=r"flat or inverted at the start .* where MooneyRivlin has no finite energy"):
        next(sp.simulate(scene, sp.Implicit(contact=None), dt=0.01, steps=1, initial_positions=mirrored))
