"""Every material against finite differences, LAPACK and linear elasticity; element kernels against the batched form."""

import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from supple.errors import SceneError
from supple.materials.elastic import ELASTIC_MATERIALS
from supple.materials.kinds import STRETCH_ENERGIES
from supple.materials.material import lame_from_engineering
from supple.materials.tet_energies import element_energies, element_gradients, element_hessians
from supple.numerics.svd3 import rotation_variant_svd

YOUNGS, POISSON = 1e5, 0.4
MATERIALS = [pytest.param(kind(youngs=YOUNGS, poisson=POISSON), id=kind.__name__) for kind in ELASTIC_MATERIALS]


def rotation(vector):
    """The rotation nearest to a matrix made of the vector (any rotation will do)."""
    a, b, c = vector
    U, _, V = rotation_variant_svd(np.eye(3) + np.array([[0, -c, b], [c, 0, -a], [-b, a, 0]]))
    return U @ V.T


angles = st.tuples(*[st.floats(-3, 3)] * 3)
states = st.tuples(
    angles,
    angles,
    st.one_of(
        st.tuples(*[st.floats(0.3, 3.0)] * 3),
        # nearly inverted, repeated, and inverted
        st.tuples(st.floats(0.5, 2.0), st.floats(0.3, 1.0), st.floats(0.003, 0.1)),
        st.floats(0.5, 2.0).map(lambda v: (v, v, v)),
        st.tuples(st.floats(0.5, 2.0), st.floats(0.3, 1.5)).map(lambda v: (v[0], v[0], v[1])),
        st.tuples(st.floats(0.8, 2.0), st.floats(0.5, 0.7), st.floats(-0.4, -0.01)),
    ),
)


def deformation(state, material):
    left, right, s = state
    if material.stretch_functions.needs_positive_volume:
        s = tuple(abs(v) for v in s)
    return rotation(left) * np.array(s) @ rotation(right).T, min(abs(v) for v in s)


def slope(errors):
    """Order of convergence over consecutive halvings of the step, where truncation is above round-off."""
    return np.log2(errors[:-1] / errors[1:])


def assert_second_order(approximation, exact, size, width, floor):
    """Central differences with steps h, h/2, h/4, h/8 converge to `exact` like h^2, or agree to round-off."""
    steps = width * 0.5 ** np.arange(4)
    errors = np.array([np.abs(approximation(h) - exact).max() for h in steps]) / size
    if errors[0] < floor:
        return
    assert errors[-1] < errors[0] / 16.0 + floor
    truncated = errors > 30.0 * floor
    if truncated.all():
        assert slope(errors)[-1] == pytest.approx(2.0, abs=0.15)


@pytest.mark.parametrize("material", MATERIALS)
@settings(max_examples=25, deadline=None)
@given(states, st.integers(0, 2**31))
def test_derivatives_have_slope_two(material, state, seed):
    F, smallest = deformation(state, material)
    dF = np.random.default_rng(seed).normal(size=(3, 3))
    dF /= np.linalg.norm(dF)
    P, H = material.first_piola(F), material.hessian(F)
    np.testing.assert_array_equal(H, H.T)
    # The steps stay inside the region where the density is smooth: before J = 0 for the logarithm.
    width = 0.02 * min(1.0, smallest) if material.stretch_functions.needs_positive_volume else 4e-3
    size = max(np.abs(P).max(), YOUNGS * np.linalg.norm(F))
    assert_second_order(
        lambda h: (material.energy_density(F + h * dF) - material.energy_density(F - h * dF)) / (2 * h),
        np.sum(P * dF),
        size,
        width,
        1e-13 / width,
    )
    assert_second_order(
        lambda h: (material.first_piola(F + h * dF) - material.first_piola(F - h * dF)).ravel() / (2 * h),
        H @ dF.ravel(),
        np.abs(H).max(),
        width,
        1e-13 / width,
    )


@pytest.mark.parametrize("material", MATERIALS)
@settings(max_examples=40, deadline=None)
@given(states)
def test_projection_is_the_nearest_semidefinite_matrix(material, state):
    F, _ = deformation(state, material)
    H = material.hessian(F)
    w, Q = np.linalg.eigh(H)
    size = np.abs(H).max()
    np.testing.assert_allclose(
        material.hessian(F, project=True), Q * np.maximum(w, 0.0) @ Q.T, atol=1e-12 * size, rtol=0
    )


@pytest.mark.parametrize("material", MATERIALS)
def test_rest_state(material):
    assert material.energy_density(np.eye(3)) == 0.0
    turned = rotation((0.3, -0.8, 0.5))
    assert abs(material.energy_density(turned)) < 1e-20 * YOUNGS
    assert np.abs(material.first_piola(turned)).max() < 1e-14 * YOUNGS


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize("poisson", [0.0, 0.3, -0.4])
def test_small_strains_are_linear_elasticity(material, poisson):
    material = type(material)(youngs=YOUNGS, poisson=poisson)
    mu, lam = lame_from_engineering(YOUNGS, poisson)
    if type(material).__name__ == "ARAP":
        lam = 0.0
    I = np.eye(3)  # noqa: E741
    linear = lam * np.einsum("ij,kl->ijkl", I, I) + mu * (
        np.einsum("ik,jl->ijkl", I, I) + np.einsum("il,jk->ijkl", I, I)
    )
    np.testing.assert_allclose(material.hessian(I), linear.reshape(9, 9), atol=1e-12 * YOUNGS)


@pytest.mark.parametrize("material", MATERIALS)
def test_objectivity_and_isotropy(material):
    rng = np.random.default_rng(8)
    F = np.eye(3) + 0.2 * rng.normal(size=(3, 3))
    R, Q = rotation(rng.normal(size=3)), rotation(rng.normal(size=3))
    assert material.energy_density(R @ F @ Q) == pytest.approx(material.energy_density(F), rel=1e-12)
    np.testing.assert_allclose(
        material.first_piola(R @ F @ Q), R @ material.first_piola(F) @ Q, atol=1e-11 * YOUNGS, rtol=0
    )


def test_published_densities():
    """The formulas of the materials' files, evaluated the plain way."""
    rng = np.random.default_rng(2)
    F = np.eye(3) + 0.3 * rng.normal(size=(50, 3, 3))
    F = F[np.linalg.det(F) > 0.05]
    s = np.linalg.svd(F)[1]
    J, Ic = np.linalg.det(F), (F**2).sum(axis=(1, 2))
    E = 0.5 * (F.swapaxes(1, 2) @ F - np.eye(3))
    for kind in ELASTIC_MATERIALS:
        material = kind(youngs=YOUNGS, poisson=POISSON)
        mu, lam = material.lame_parameters()
        expected = {
            "StableNeoHookean": mu / 2 * (Ic - 3) - mu * (J - 1) + lam / 2 * (J - 1) ** 2,
            "NeoHookean": mu / 2 * (Ic - 3) - mu * np.log(J) + lam / 2 * np.log(J) ** 2,
            "FixedCorotated": mu * ((s - 1) ** 2).sum(axis=1) + lam / 2 * (J - 1) ** 2,
            "ARAP": mu * ((s - 1) ** 2).sum(axis=1),
            "StVenantKirchhoff": mu * (E**2).sum(axis=(1, 2)) + lam / 2 * np.trace(E, axis1=1, axis2=2) ** 2,
        }[kind.__name__]
        np.testing.assert_allclose(material.energy_density(F), expected, rtol=1e-10, err_msg=kind.__name__)


def test_parameters_per_tet_and_shapes():
    youngs = np.array([1e4, 1e5, 1e6])
    F = np.eye(3) + 0.1 * np.random.default_rng(1).normal(size=(3, 3, 3))
    for kind in ELASTIC_MATERIALS:
        many = kind(youngs=youngs, poisson=np.array([0.1, 0.2, 0.3]))
        for k, nu in enumerate((0.1, 0.2, 0.3)):
            one = kind(youngs=youngs[k], poisson=nu)
            assert many.energy_density(F)[k] == one.energy_density(F[k])
            np.testing.assert_array_equal(many.hessian(F, project=True)[k], one.hessian(F[k], project=True))
        with pytest.raises(SceneError, match="youngs has 3 values for 1 tets"):
            many.first_piola(F[0])
    stiff = ELASTIC_MATERIALS[0](youngs=1e5, poisson=0.3)
    grid = np.broadcast_to(np.eye(3), (2, 4, 3, 3))
    assert stiff.energy_density(grid).shape == (2, 4)
    assert stiff.first_piola(grid).shape == (2, 4, 3, 3)
    assert stiff.hessian(grid).shape == (2, 4, 9, 9)
    with pytest.raises(SceneError, match="last two axes"):
        stiff.energy_density(np.zeros(3))


@pytest.fixture(scope="module")
def soup():
    """600 separate tets, deformed at random, of all kinds of material; some inverted where their material allows it."""
    rng = np.random.default_rng(6)
    m = 600
    tets = np.arange(4 * m, dtype=np.int32).reshape(-1, 4)
    shape = np.eye(3) + 0.3 * rng.normal(size=(m, 3, 3))
    kind = rng.integers(0, len(ELASTIC_MATERIALS), size=m).astype(np.int32)
    F = np.eye(3) + 0.5 * rng.normal(size=(m, 3, 3))
    positive = np.array([energy.needs_positive_volume for energy in STRETCH_ENERGIES])[kind]
    F[positive & (np.linalg.det(F) < 0.05)] = np.eye(3) * 0.9
    Ds = F @ shape
    x = np.zeros((m, 4, 3))
    x[:, 1:] = Ds.swapaxes(1, 2)
    x += rng.normal(size=(m, 1, 3))
    mu, lam = rng.uniform(1e3, 1e4, size=m), rng.uniform(1e3, 1e5, size=m)
    volumes = rng.uniform(0.5, 2.0, size=m)
    return np.ascontiguousarray(x.reshape(-1, 3)), tets, np.linalg.inv(shape).copy(), volumes, kind, mu, lam


def test_element_kernels_are_contractions_of_the_batched_form(soup):
    x, tets, Dm_inv, volumes, kind, mu, lam = soup
    m = len(tets)
    energies, gradients, hessians = np.empty(m), np.empty((m, 4, 3)), np.empty((m, 12, 12))
    element_energies(*soup, energies)
    element_gradients(*soup, gradients)
    Ds = (x[tets[:, 1:]] - x[tets[:, :1]]).swapaxes(1, 2)
    F = Ds @ Dm_inv
    # dF_ij / dx_pk = (i == k) G_pj
    G = np.concatenate([-Dm_inv.sum(axis=1, keepdims=True), Dm_inv], axis=1)
    dF = np.einsum("ik,epj->eijpk", np.eye(3), G).reshape(m, 9, 12)
    for project in (False, True):
        element_hessians(*soup, project, hessians)
        np.testing.assert_array_equal(hessians, hessians.swapaxes(1, 2))
        for number, cls in enumerate(ELASTIC_MATERIALS):
            here = kind == number
            material = with_lame(cls, mu[here], lam[here])
            H = np.einsum("eai,eab,ebj->eij", dF[here], material.hessian(F[here], project=project), dF[here])
            H *= volumes[here, None, None]
            size = np.abs(H).max(axis=(1, 2), keepdims=True)
            np.testing.assert_allclose(hessians[here] / size, H / size, atol=1e-12)
    for number, cls in enumerate(ELASTIC_MATERIALS):
        here = kind == number
        material = with_lame(cls, mu[here], lam[here])
        np.testing.assert_allclose(energies[here], volumes[here] * material.energy_density(F[here]), rtol=1e-12)
        P = material.first_piola(F[here]).reshape(-1, 9)
        g = volumes[here, None] * np.einsum("ea,eai->ei", P, dF[here])
        np.testing.assert_allclose(gradients[here].reshape(-1, 12), g, atol=1e-11 * np.abs(g).max(), rtol=1e-9)


def with_lame(cls, mu, lam):
    """A material of the class whose own density has exactly these parameters."""

    class WithLame(cls):
        def lame_parameters(self):
            return mu, lam

        def per_tet(self, n_tets):
            return self._tet_material(n_tets, cls.energy_kind(), mu, lam)

    return WithLame(youngs=1.0, poisson=0.0)


def test_compiled_kernels_come_from_the_cache_in_a_new_process(soup):
    element_energies(*soup, np.empty(len(soup[1])))
    code = (
        "import numpy as np; from supple.materials import tet_energies as iso\n"
        "i, f = np.int32, np.float64\n"
        "iso.element_energies(np.zeros((4, 3)), np.arange(4, dtype=i)[None], np.eye(3)[None].copy(), np.ones(1),"
        " np.zeros(1, i), np.ones(1), np.ones(1), np.empty(1))\n"
        "stats = [form.stats for form in iso.element_energies.of[0].forms]\n"
        "assert sum(sum(one.cache_hits.values()) for one in stats) == 1, stats\n"
        "assert not any(one.cache_misses for one in stats), stats\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, env=os.environ)


def test_classes_and_energies_are_registered_in_the_same_order():
    assert [material.stretch_functions for material in ELASTIC_MATERIALS] == list(STRETCH_ENERGIES)
    assert [material.energy_kind() for material in ELASTIC_MATERIALS] == list(range(len(ELASTIC_MATERIALS)))


def test_an_energy_that_is_not_registered_is_an_error():
    class Unregistered(ELASTIC_MATERIALS[0]):
        stretch_functions = ELASTIC_MATERIALS[0].stretch_functions._replace()

    with pytest.raises(SceneError, match="Unregistered: its energy is not registered"):
        Unregistered(youngs=1e5, poisson=0.3).energy_density(np.eye(3))
