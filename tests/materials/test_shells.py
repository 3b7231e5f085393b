"""Energies of shells: derivatives, invariance, patch test, and bending that does not depend on the mesh."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.derivatives import assert_derivatives, gradient_of, hessian_product

import supple as sp
from supple.materials.shells.elements import elements_of
from supple.numerics.sparse.block_csr import build_pattern
from supple.solvers.implicit.energies.damping import StrainRate
from supple.solvers.implicit.energies.shells import ShellEnergy, ShellViscosity
from supple.solvers.implicit.newton import direct_solver

NO_TETS = np.zeros((0, 4), dtype=np.int32)
TETRAHEDRON = sp.SurfaceMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


def disc():
    """Seven triangles around a vertex, and one more; not plane."""
    angles = 2.0 * np.pi * np.arange(7) / 7
    ring = np.column_stack([np.cos(angles), 0.2 * np.cos(3.0 * angles), np.sin(angles)])
    triangles = [[0, 1 + (k + 1) % 7, 1 + k] for k in range(7)] + [[2, 8, 1]]
    return sp.SurfaceMesh(np.vstack([[0.0, 0.1, 0.0], ring, [1.2, 0.1, 1.2]]), triangles)


def shells_of(surface, held=(), **more):
    given = {"youngs": 1e4, "poisson": 0.3, "thickness": 0.1, "damping": 0.1}
    holders = np.full(len(surface.vertices), -1)
    holders[list(held)] = 0
    return elements_of([(surface.vertices, surface.triangles, 0, sp.ShellMaterial(**given | more))], holders)


def moved(surface, seed):
    rng = np.random.default_rng(seed)
    return surface.vertices + 0.1 * rng.normal(size=surface.vertices.shape), rng.normal(size=surface.vertices.shape)


@pytest.mark.parametrize("surface", [TETRAHEDRON, disc()], ids=["closed", "open"])
@pytest.mark.parametrize("membrane", ["neo_hookean", "st_venant_kirchhoff"])
@pytest.mark.parametrize("poisson", [-0.2, 0.0, 0.5])
def test_gradient_and_hessian_are_derivatives_of_the_energy(surface, membrane, poisson):
    energy = ShellEnergy(shells_of(surface, membrane=membrane, poisson=poisson, bending=5.0))
    for seed in range(3):
        x, d = moved(surface, seed)
        assert_derivatives(energy, hessian_product(energy, NO_TETS, x, d), x, d, 1e-3)


def test_gradient_and_hessian_of_damping_are_derivatives_of_its_potential():
    surface = disc()
    viscosity = ShellViscosity(shells_of(surface, held=(0, 1, 2)))
    damping = viscosity.damping(StrainRate(7.0, viscosity.strains(moved(surface, 5)[0])))
    x, d = moved(surface, 1)
    assert_derivatives(damping, hessian_product(damping, NO_TETS, x, d), x, d, 1e-3)


@pytest.mark.parametrize("membrane", ["neo_hookean", "st_venant_kirchhoff"])
def test_projected_hessian_is_positive_semi_definite_and_correction_is_not_above_zero(membrane):
    surface = disc()
    energy = ShellEnergy(shells_of(surface, membrane=membrane))
    x, _ = moved(surface, 2)
    unit = np.eye(x.size).reshape(-1, *x.shape)
    whole = np.array([hessian_product(energy, NO_TETS, x, d, project=True).ravel() for d in unit])
    np.testing.assert_allclose(whole, whole.T, atol=1e-9 * np.abs(whole).max())
    assert np.linalg.eigvalsh(whole).min() > -1e-12 * np.abs(whole).max()
    assert np.linalg.eigvalsh(np.array([hessian_product(energy, NO_TETS, x, d).ravel() for d in unit])).min() < 0.0
    shells = energy.shells
    bound = np.zeros((len(shells.hinges),) * 2)
    for hinges, matrix in zip(shells.hinge_of, shells.bounds, strict=True):
        own = hinges >= 0
        bound[np.ix_(hinges[own], hinges[own])] += matrix[np.ix_(own, own)]
    stiffness = np.array([shells.moments(one) for one in np.eye(len(bound))])
    assert np.linalg.eigvalsh(bound - stiffness).min() > -1e-10 * np.abs(bound).max()


def test_energy_and_forces_do_not_see_rigid_motions():
    surface = disc()
    energy = ShellEnergy(shells_of(surface))
    R = Rotation.from_rotvec((2.0, -1.0, 0.5)).as_matrix()
    at_rest = surface.vertices @ R.T + (3.0, -2.0, 1.0)
    assert energy.value(at_rest) == pytest.approx(0.0, abs=1e-18)
    np.testing.assert_allclose(gradient_of(energy, at_rest), 0.0, atol=1e-10)
    x, _ = moved(surface, 3)
    assert energy.value(x @ R.T) == pytest.approx(energy.value(x), rel=1e-12)
    forces = gradient_of(energy, x)
    np.testing.assert_allclose(forces.sum(axis=0), 0.0, atol=1e-10 * np.abs(forces).max())
    np.testing.assert_allclose(np.cross(x, forces).sum(axis=0), 0.0, atol=1e-10 * np.abs(forces).max())


@pytest.mark.parametrize("membrane", ["neo_hookean", "st_venant_kirchhoff"])
def test_patch_of_a_membrane_under_uniform_stretch(membrane):
    ring = disc().vertices * (1.0, 0.0, 1.0)
    surface = sp.SurfaceMesh(ring, disc().triangles)
    shells = shells_of(surface, membrane=membrane, youngs=1e6, poisson=0.4)
    e = 1e-5
    x = ring * (1.0 + e, 1.0, 1.0)
    energy = ShellEnergy(shells)
    np.testing.assert_allclose(gradient_of(energy, x)[0], 0.0, atol=1e-9)  # the inner vertex is in balance
    uniaxial_strain = 0.5 * 1e6 / (1.0 - 0.4**2) * e**2 * 0.1 * surface.area
    assert energy.value(x) == pytest.approx(uniaxial_strain, rel=1e-4)


def test_neo_hookean_is_that_of_plane_stress_and_resists_collapse():
    surface = sp.SurfaceMesh([[0, 0, 0], [1, 0, 0], [0, 0, 1]], [[0, 2, 1]])
    stretch = np.array([1.7, 1.0, 0.8])
    incompressible = shells_of(surface, poisson=0.5).energy(surface.vertices * stretch)
    thinner = 1.0 / (1.7 * 0.8)
    mu, volume = 1e4 / 3.0, 0.05
    assert incompressible == pytest.approx(0.5 * mu * volume * (1.7**2 + 0.8**2 + thinner**2 - 3.0))
    flat = surface.vertices * (1.0, 1.0, 0.0)
    assert ShellEnergy(shells_of(surface)).value(flat) == np.inf
    assert np.isfinite(shells_of(surface, membrane="st_venant_kirchhoff").energy(flat))


def test_sheet_without_bending_stiffness_folds_at_no_cost():
    surface = sp.SurfaceMesh([[0, 0, 0], [1, 0, 0], [0, 0, 1], [1, 0, 1]], [[0, 2, 1], [1, 2, 3]])
    x = surface.vertices.copy()
    axis = (x[2] - x[1]) / np.sqrt(2.0)
    x[3] = x[1] + Rotation.from_rotvec(1.0 * axis).apply(x[3] - x[1])
    assert shells_of(surface, bending=0.0).energy(x) == pytest.approx(0.0, abs=1e-15)
    assert shells_of(surface).energy(x) > 0.0


@pytest.mark.parametrize("without_pardiso", [False, True])
def test_direct_solver_adds_a_correction_and_finds_what_is_indefinite(monkeypatch, without_pardiso):
    if without_pardiso:
        monkeypatch.setattr(direct_solver, "_pardiso", lambda: None)
    pattern = build_pattern(np.array([[0, 1, 2, 3], [1, 2, 3, 4]], dtype=np.int32), 5)
    rng = np.random.default_rng(0)
    root = rng.normal(size=(2, 12, 12))
    data = np.zeros((pattern.blocks, 3, 3))
    pattern.assemble(np.einsum("kij,klj->kil", root, root) + np.eye(12), np.zeros((5, 3, 3)), data)
    A, b, g = pattern.to_scipy(data).toarray(), rng.normal(size=(5, 3)), rng.normal(size=15)
    C = -0.5 * np.outer(g, g) / (g @ np.linalg.solve(A, g))

    def correct(share):
        return lambda v: share * (C @ v.ravel()).reshape(v.shape)

    low_rank = rng.normal(size=(1, 5, 3))
    whole = A + C + np.outer(low_rank, low_rank)
    for definite in (False, True):
        x = direct_solver.solve_directly(pattern, data, b, definite, low_rank, correct(1.0))
        np.testing.assert_allclose(x.ravel(), np.linalg.solve(whole, b.ravel()), rtol=1e-4)
    # The sum is indefinite, and so is the matrix alone.
    along = g.reshape(5, 3)
    assert direct_solver.solve_directly(pattern, data, along, False, correct=correct(3.0)) is None
    assert direct_solver.solve_directly(pattern, -data, b, True, correct=correct(1.0)) is None
