"""Every potential of the objective: gradients and Hessians against differences of values and gradients, slope 2."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.derivatives import assert_derivatives, gradient_of, hessian_product

import supple as sp
from supple.materials.elastic import ELASTIC_MATERIALS, NeoHookean
from supple.model.system import build_system
from supple.solvers.implicit.energies.damping import Damping, StrainRate, viscosity_of
from supple.solvers.implicit.energies.elasticity import elasticity_of
from supple.solvers.implicit.energies.inversion_barrier import inversion_barrier
from supple.solvers.implicit.energies.potential import HessianBlocks
from supple.solvers.implicit.energies.vertex_potential import VertexPotential, inertia
from supple.solvers.implicit.newton.hessian_projection import ProjectedTerms
from supple.solvers.implicit.newton.objective import Objective

ONSET = 0.1  # the default of `Implicit.barrier_onset`
MESH = sp.shapes.box((0.3, 0.2, 0.2), (2, 1, 1))


def system_of(material_type, poisson=0.3, **extra):
    material = material_type(youngs=2e4, poisson=poisson, density=800.0, **extra)
    return build_system(sp.Scene([sp.Body("block", MESH, material)]))


def near_inverted(seed, squeeze):
    """Positions with random shear and noise, flattened until the tets have almost no volume; none is inverted."""
    rng = np.random.default_rng(seed)
    A = np.eye(3) + 0.25 * rng.uniform(-1, 1, (3, 3))
    U, _, V = np.linalg.svd(A)
    A = U @ np.diag([1.2, 0.9, squeeze]) @ V * np.linalg.det(U @ V)
    return MESH.vertices @ A.T + 0.01 * squeeze * rng.normal(size=MESH.vertices.shape)


def potentials(system, x, seed):
    rng = np.random.default_rng(seed)
    n = len(x)
    elasticity = elasticity_of(system)
    viscosity = viscosity_of(elasticity)
    assert viscosity is not None
    return {
        "elasticity": elasticity,
        "inertia": inertia(system.masses, x + 0.01 * rng.normal(size=(n, 3)), 1e-4),
        "vertices": VertexPotential(x, np.arange(3.0 * n).reshape(n, 3), rng.normal(size=(n, 3))),
        "damping": Damping(viscosity, StrainRate(60.0, viscosity.strains(x + 0.01 * rng.normal(size=(n, 3))))),
    }


@pytest.mark.parametrize("material", ELASTIC_MATERIALS, ids=lambda m: m.__name__)
@settings(max_examples=4, deadline=None)
@given(seed=st.integers(0, 2**31), squeeze=st.floats(0.1, 1.1))
def test_gradients_and_hessians_have_slope_two(material, seed, squeeze):
    system = system_of(material, damping=0.01)
    x = near_inverted(seed, squeeze)
    d = np.random.default_rng(seed + 1).normal(size=x.shape)
    # A direction so short that no tet comes near inversion.
    d *= 1e-2 * squeeze * 0.1 / np.abs(d).max()
    for potential in potentials(system, x, seed).values():
        assert_derivatives(potential, hessian_product(potential, system.tets, x, d), x, d, 0.5)


@pytest.mark.parametrize("material", ELASTIC_MATERIALS, ids=lambda m: m.__name__)
def test_the_model_is_the_sum_of_its_parts(material):
    system = system_of(material, damping=0.01)
    x = near_inverted(7, 0.6)
    objective = Objective(list(potentials(system, x, 7).values()))
    for projected in ProjectedTerms:
        together = HessianBlocks.zeros(len(system.tets), len(x))
        apart = HessianBlocks.zeros(len(system.tets), len(x))
        model = objective.model(x, together, projected)
        apart.clear()
        for term in objective.terms:
            term.add_hessian(x, apart, projected.includes(term.projection))
        assert model.energy == pytest.approx(objective.value(x), rel=1e-12)
        assert np.allclose(model.gradient, objective.gradient(x), rtol=1e-10, atol=1e-9)
        assert np.allclose(together.tets, apart.tets, rtol=1e-10, atol=1e-7)
        assert np.array_equal(together.vertices, apart.vertices)


@pytest.mark.parametrize("material", [sp.StableNeoHookean], ids=lambda m: m.__name__)
def test_terms_may_come_in_any_order(material):
    system = system_of(material, damping=0.01)
    x = near_inverted(7, 0.6)
    terms = list(potentials(system, x, 7).values())
    results = []
    for order in (terms, terms[::-1], terms[2:] + terms[:2]):
        for _ in range(2):  # what an earlier sum left in the memory does not count
            blocks = HessianBlocks.zeros(len(system.tets), len(x)) if not results else results[-1][1]
            gradient = Objective(order).model(x, blocks, ProjectedTerms.NONE).gradient
        results.append((gradient, blocks, blocks.elements.copy(), blocks.vertices.copy()))
    for gradient, _, elements, vertices in results[1:]:
        np.testing.assert_allclose(gradient, results[0][0], rtol=1e-12, atol=1e-10)
        np.testing.assert_allclose(elements, results[0][2], rtol=1e-12, atol=1e-8)
        np.testing.assert_allclose(vertices, results[0][3], rtol=1e-12)
    without = [term for term in terms if term.label != "elasticity"]
    Objective(without).model(x, blocks)
    assert not blocks.elements.any()


def test_projected_hessians_have_no_negative_eigenvalue():
    system = system_of(sp.StableNeoHookean, damping=0.01)
    rng = np.random.default_rng(0)
    x = MESH.vertices + 0.1 * rng.normal(size=MESH.vertices.shape)
    for potential in potentials(system, x, 0).values():
        blocks = HessianBlocks.zeros(len(system.tets), len(x))
        potential.add_hessian(x, blocks, True)
        largest = max(np.abs(blocks.tets).max(), np.abs(blocks.vertices).max())
        assert np.linalg.eigvalsh(blocks.tets).min() >= -1e-9 * largest
        assert np.linalg.eigvalsh(blocks.vertices).min() >= -1e-9 * largest


@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 2**31), squeeze=st.floats(0.02, 0.08))
def test_the_inversion_barrier_has_slope_two(seed, squeeze):
    system = system_of(sp.StableNeoHookean)
    barrier = inversion_barrier(elasticity_of(system), np.ones(len(system.tets), dtype=bool), ONSET)
    assert barrier is not None
    x = near_inverted(seed, squeeze)
    assert barrier.value(x) > 0.0
    d = np.random.default_rng(seed + 1).normal(size=x.shape)
    d *= 1e-3 * squeeze * 0.1 / np.abs(d).max()
    assert_derivatives(barrier, hessian_product(barrier, system.tets, x, d), x, d, 0.5)


def test_the_inversion_barrier_acts_only_near_inversion():
    system = system_of(sp.StableNeoHookean)
    barrier = inversion_barrier(elasticity_of(system), np.ones(len(system.tets), dtype=bool), ONSET)
    assert barrier is not None
    for J, active in ((1.0, False), (1.01 * ONSET, False), (0.9 * ONSET, True)):
        x = MESH.vertices * np.array([1.0, J, 1.0])
        assert (barrier.value(x) > 0.0) is active
        assert gradient_of(barrier, x).any() == active
    assert barrier.value(MESH.vertices * np.array([1.0, -1.0, 1.0])) == np.inf
    rubber = build_system(sp.Scene([sp.Body("block", MESH, NeoHookean(youngs=1e4, poisson=0.3))]))
    assert inversion_barrier(elasticity_of(rubber), np.ones(len(MESH.tets), dtype=bool), ONSET) is None


def rotation(angle, axis):
    from scipy.spatial.transform import Rotation

    return Rotation.from_rotvec(angle * np.asarray(axis) / np.linalg.norm(axis)).as_matrix()


def test_rigid_motion_of_any_size_is_not_damped():
    system = system_of(sp.StableNeoHookean, damping=0.05)
    x = near_inverted(3, 0.7)
    viscosity = viscosity_of(elasticity_of(system))
    assert viscosity is not None
    damping = Damping(viscosity, StrainRate(60.0, viscosity.strains(x)))
    turned = x @ rotation(2.0, (1, 2, 3)).T + np.array([5.0, 0.0, -2.0])
    stretched = 1.01 * x
    assert damping.value(turned) < 1e-20 * damping.value(stretched)
    assert np.abs(gradient_of(damping, turned)).max() < 1e-10 * np.abs(gradient_of(damping, stretched)).max()


@pytest.mark.parametrize("motion", ["random", "volumetric"])
@pytest.mark.parametrize("material", ELASTIC_MATERIALS, ids=lambda m: m.__name__)
def test_damping_is_kelvin_voigt(material, motion):
    """At small strains the force at strain e and rate e' is the elastic force at e + tau e'."""
    tau = 0.02
    system = system_of(material, poisson=0.45, damping=tau)
    elasticity = elasticity_of(system)
    viscosity = viscosity_of(elasticity)
    assert viscosity is not None
    rng = np.random.default_rng(1)
    field = rng.normal(size=MESH.vertices.shape) if motion == "random" else 3.0 * MESH.vertices
    u, v = 1e-6 * field, 1e-4 * rng.permutation(field) if motion == "random" else 1e-4 * field
    x = MESH.vertices + u
    reference = viscosity.strains(x) - 0.5 * (viscosity.strains(x + v) - viscosity.strains(x - v))
    force = gradient_of(Damping(viscosity, StrainRate(1.0, reference)), x) + gradient_of(elasticity, x)
    expected = gradient_of(elasticity, MESH.vertices + u + tau * v)
    assert np.abs(force - expected).max() < 1e-4 * np.abs(expected).max()


def test_undamped_bodies_have_no_viscosity():
    assert viscosity_of(elasticity_of(system_of(sp.StableNeoHookean))) is None


def test_a_material_of_xpbd_is_an_error_that_names_the_body():
    scene = sp.Scene([sp.Body("jelly", MESH, sp.EdgesAndVolume())])
    with pytest.raises(sp.SolverError, match=r"body 'jelly': EdgesAndVolume"):
        elasticity_of(build_system(scene))
