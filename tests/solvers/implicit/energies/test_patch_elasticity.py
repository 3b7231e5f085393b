"""The energy of patches: derivatives, projection, agreement with the tets' energy on affine motions, regions."""

import numba
import numpy as np
import pytest
from tests.derivatives import dense_couplings, differences, gradient_of

import supple as sp
from supple.errors import SceneError
from supple.materials.elastic import FixedCorotated, NeoHookean
from supple.materials.patches.stars import star_patches
from supple.model.system import build_system
from supple.solvers.implicit.energies.elasticity import elasticity_of
from supple.solvers.implicit.energies.inversion_barrier import inversion_barrier
from supple.solvers.implicit.energies.potential import HessianBlocks

EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])
MESH = sp.shapes.box((0.3, 0.2, 0.2), (2, 2, 2))
MATERIALS = [sp.StableNeoHookean, NeoHookean, FixedCorotated]
RATIOS = [0.1, 0.49]  # without and with energies of stars


def energy_of(material, mesh=MESH):
    return elasticity_of(build_system(sp.Scene([sp.Body("block", mesh, material)])))


def patched(kind, poisson, **extra):
    return kind(youngs=2e4, poisson=poisson, integration="patches", **extra)


def deformed(seed):
    rng = np.random.default_rng(seed)
    F = np.eye(3) + 0.2 * rng.normal(size=(3, 3))
    return MESH.vertices @ F.T + 0.01 * rng.normal(size=MESH.vertices.shape)


def hessian_of(energy, x, project):
    """The dense matrix (3n, 3n)."""
    n = len(x)
    blocks = HessianBlocks.zeros(len(energy.system.tets), n)
    energy.add_hessian(x, blocks, project)
    out = np.zeros((n, 3, n, 3))
    for tet, block in zip(energy.system.tets, blocks.tets.reshape(-1, 4, 3, 4, 3), strict=True):
        out[np.ix_(tet, range(3), tet, range(3))] += block
    return out.reshape(3 * n, 3 * n) + dense_couplings(blocks.patches, n)


@pytest.mark.parametrize("poisson", RATIOS)
@pytest.mark.parametrize("kind", MATERIALS, ids=lambda kind: kind.__name__)
def test_derivatives_are_the_limits_of_differences(kind, poisson):
    energy, x = energy_of(patched(kind, poisson)), deformed(0)
    d = np.random.default_rng(1).normal(size=x.shape)
    slope, product = (gradient_of(energy, x) * d).sum(), (hessian_of(energy, x, False) @ d.ravel()).reshape(-1, 3)
    errors = []
    for t in (1e-3, 5e-4):
        change, force = differences(energy, x, d, t)
        errors.append((abs(change - slope) / abs(slope), np.abs(force - product).max() / np.abs(product).max()))
    assert max(errors[1]) < 1e-3
    np.testing.assert_allclose(np.array(errors[0]) / errors[1], 4.0, rtol=0.05)
    force = differences(energy, x, d, 1e-6)[1]
    np.testing.assert_allclose(force, product, atol=1e-7 * np.abs(product).max())


@pytest.mark.parametrize("kind", MATERIALS, ids=lambda kind: kind.__name__)
def test_the_hessian_is_symmetric_and_its_projection_semidefinite(kind):
    energy, x = energy_of(patched(kind, 0.49)), deformed(2)
    x[:, 1] *= 0.5  # strong compression: the true Hessian is indefinite
    true, projected = hessian_of(energy, x, False), hessian_of(energy, x, True)
    np.testing.assert_array_equal(true, true.T)
    assert np.linalg.eigvalsh(true)[0] < 0.0
    values = np.linalg.eigvalsh(projected)
    assert values[0] > -1e-12 * values[-1]
    # Where nothing is negative, projection changes nothing.
    rest = hessian_of(energy, MESH.vertices, True)
    np.testing.assert_allclose(rest, hessian_of(energy, MESH.vertices, False), atol=1e-10 * np.abs(rest).max())


@pytest.mark.parametrize("poisson", RATIOS)
@pytest.mark.parametrize("kind", MATERIALS, ids=lambda kind: kind.__name__)
def test_an_affine_motion_has_the_energy_of_the_tets(kind, poisson):
    material = patched(kind, poisson)
    energy, F = energy_of(material), np.eye(3) + 0.2 * np.random.default_rng(3).normal(size=(3, 3))
    x = MESH.vertices @ F.T + [100.0, 0.0, -50.0]
    expected = material.energy_density(F) * MESH.volumes
    assert energy.value(x) == pytest.approx(expected.sum(), rel=1e-11)
    np.testing.assert_allclose(energy.energies(x), expected, rtol=1e-10)
    inner = np.setdiff1d(np.arange(len(x)), np.unique(MESH.surface.triangles))
    assert np.abs(gradient_of(energy, x)[inner]).max() < 1e-10 * np.abs(gradient_of(energy, x)).max()


def test_no_force_at_rest_and_none_on_the_whole():
    energy = energy_of(patched(sp.StableNeoHookean, 0.49))
    assert np.abs(gradient_of(energy, MESH.vertices + np.array([3.0, 4.0, 5.0]))).max() < 1e-9
    x = deformed(4)
    g = gradient_of(energy, x)
    assert np.abs(g.sum(axis=0)).max() < 1e-12 * np.abs(g).sum()
    assert np.abs(np.cross(x, g).sum(axis=0)).max() < 1e-12 * np.abs(g).sum()


@pytest.mark.parametrize("cells", [(1, 1, 1), (16, 1, 1), (12, 4, 1), (5, 5, 5)])
def test_stars_are_connected_and_of_like_size(cells):
    """Thin bodies have no vertex with twelve tets around it; nothing is left over, and nothing grows along them."""
    mesh = sp.shapes.box(cells, cells)
    edges = np.sort(mesh.tets[:, EDGES], axis=2).reshape(-1, 2)
    numbers = np.unique(edges, axis=0, return_inverse=True)[1].reshape(-1, 6).astype(np.int32)
    star = star_patches(mesh.tets.astype(np.int32), numbers)
    sizes = np.bincount(star)
    assert sizes.min() >= min(6, len(star))
    assert sizes.max() <= 48
    for k in range(len(sizes)):
        own = [set(row) for row in mesh.tets[star == k]]
        found = own.pop()
        while touching := [row for row in own if row & found]:
            own = [row for row in own if not row & found]
            found = found.union(*touching)
        assert not own


def test_patches_do_not_reach_into_another_region():
    """Two halves of different stiffness: an affine motion has the energy of each half with its own material."""
    index = (MESH.vertices[MESH.tets].mean(axis=1)[:, 0] > 0.0).astype(np.int64)
    soft, hard = patched(sp.StableNeoHookean, 0.45), NeoHookean(youngs=1e7, poisson=0.3, integration="patches")
    own = sp.StableNeoHookean(youngs=1e5, poisson=0.3)
    for other in (hard, own):
        energy = energy_of(sp.Regions(materials=[soft, other], index=index))
        F = np.eye(3) + 0.1 * np.random.default_rng(5).normal(size=(3, 3))
        x = MESH.vertices @ F.T
        densities = np.where(index == 0, soft.energy_density(F), other.energy_density(F))
        np.testing.assert_allclose(energy.energies(x), densities * MESH.volumes, rtol=1e-10)
        d = np.random.default_rng(6).normal(size=x.shape)
        force = differences(energy, x, d, 1e-6)[1]
        product = (hessian_of(energy, x, False) @ d.ravel()).reshape(-1, 3)
        np.testing.assert_allclose(force, product, atol=1e-6 * np.abs(product).max())


def test_patches_beside_a_body_of_a_law_without_a_bulk_modulus():
    tissue = sp.HolzapfelGasserOgden(c10=3e3, bulk=3e5, k1=5e4, k2=3.0, directions=[[1, 0, 0]])
    materials = [patched(sp.NeoHookean, 0.49), tissue]
    bodies = [sp.Body(f"b{k}", MESH, material) for k, material in enumerate(materials)]
    both, x = elasticity_of(build_system(sp.Scene(bodies))), deformed(3)
    alone = sum(energy_of(material).value(x) for material in materials)
    assert both.value(np.concatenate([x, x])) == pytest.approx(alone, rel=1e-12)


def test_a_tet_of_a_patch_has_a_barrier_against_inversion():
    """The energy of an edge with several tets can be finite where one of them is flat, for every material."""
    for kind in MATERIALS:
        energy = energy_of(patched(kind, 0.3))
        barrier = inversion_barrier(energy, np.ones(len(MESH.tets), dtype=bool), 0.1)
        assert barrier is not None
        x = MESH.vertices.copy()
        a, b, c, d = MESH.tets[0]
        x[a] = (x[b] + x[c] + x[d]) / 3.0
        assert barrier.value(x) == np.inf


@pytest.mark.slow
def test_the_same_bits_on_any_number_of_threads():
    mesh = sp.shapes.box((1, 1, 1), (7, 7, 7))
    energy = energy_of(patched(sp.StableNeoHookean, 0.49), mesh)
    x = mesh.vertices + 0.01 * np.random.default_rng(7).normal(size=mesh.vertices.shape)

    def parts():
        blocks, g = HessianBlocks.zeros(len(mesh.tets), len(x)), np.zeros_like(x)
        value = energy.add_model(x, g, blocks, True)
        return value, g, blocks.tets.copy(), blocks.patches[0].blocks

    before = numba.get_num_threads()
    results = []
    for threads in {1, before}:
        numba.set_num_threads(threads)
        results.append(parts())
    numba.set_num_threads(before)
    for one, other in zip(results[0], results[-1], strict=True):
        np.testing.assert_array_equal(one, other)


def test_what_cannot_be_averaged_is_refused():
    for kind in (sp.ARAP, sp.StVenantKirchhoff):
        with pytest.raises(SceneError, match=r"integration='patches' needs an energy with a volume term of J; give"):
            kind(youngs=1e4, poisson=0.3, integration="patches")
    with pytest.raises(SceneError, match="integration is 'nodes'; give 'tets' or 'patches'"):
        sp.StableNeoHookean(youngs=1e4, poisson=0.3, integration="nodes")
