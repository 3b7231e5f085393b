"""Quadratic tets in `Implicit`: derivatives, masses, loads, uniform stresses, motion, refusals."""

from dataclasses import replace

import numpy as np
import pytest
from tests.derivatives import dense_couplings, differences, gradient_of

import supple as sp
from supple.errors import SceneError, SolverError
from supple.materials.elastic import ELASTIC_MATERIALS
from supple.materials.material import Material
from supple.model.system import build_system
from supple.runtime.threads import numba_threads
from supple.solvers.implicit.details import ImplicitDetails
from supple.solvers.implicit.energies.damping import StrainRate, quadratic_viscosity_of
from supple.solvers.implicit.energies.elasticity import elasticity_of
from supple.solvers.implicit.energies.potential import HessianBlocks
from supple.solvers.implicit.inversion_guard import InversionGuard

STATIC = sp.Implicit(integrator="static", contact=None)
SOFT = sp.StableNeoHookean(youngs=1e4, poisson=0.4, density=1000.0, damping=0.01)


def wavy(mesh, size=0.01):
    """The mesh with curved edges."""
    x = mesh.vertices
    return sp.TetMesh(x + size * np.sin(7.0 * x[:, [1, 2, 0]]), mesh.nodes)


BAR = wavy(sp.shapes.box((0.6, 0.2, 0.2), (3, 1, 1), order=2))


def bar_scene(material: Material = SOFT, pinned=True, mesh=BAR, **extra):
    left = np.flatnonzero(mesh.vertices[:, 0] < mesh.vertices[:, 0].min() + 0.02)
    pins = [sp.Pin("bar", left)] if pinned else []
    return sp.Scene([sp.Body("bar", mesh, material)], pins=pins, **extra)


def equilibrium(scene, solver=STATIC, status="converged"):
    frame = list(sp.simulate(scene, solver, 1.0, 1))[-1]
    assert frame.report.status == status, frame.report.message
    return frame


def hessian_of(potential, system, x, project):
    blocks = HessianBlocks.zeros(len(system.tets), len(x))
    potential.add_hessian(x, blocks, project)
    assert not blocks.tets.any()
    return dense_couplings(blocks.patches, len(x))


def assert_derivatives(potential, system, x, scale):
    """Central differences, of the energy to 1e-6 and of the gradient to 1e-5."""
    d = np.random.default_rng(5).normal(size=x.shape)
    slope, bend = differences(potential, x, d, 1e-6)
    assert slope == pytest.approx(np.sum(gradient_of(potential, x) * d), rel=1e-6, abs=1e-9 * scale)
    H = hessian_of(potential, system, x, False)
    np.testing.assert_allclose(H, H.T, atol=1e-9 * np.abs(H).max())
    product = (H @ d.ravel()).reshape(-1, 3)
    np.testing.assert_allclose(product, bend, atol=1e-5 * np.abs(product).max())
    assert np.linalg.eigvalsh(hessian_of(potential, system, x, True)).min() > -1e-9 * np.abs(H).max()


@pytest.mark.parametrize("material", ELASTIC_MATERIALS, ids=lambda m: m.__name__)
@pytest.mark.parametrize("poisson", [0.2, 0.48])  # without and with energies of mean volumes
def test_derivatives_of_the_energy(material, poisson):
    system = build_system(bar_scene(material(youngs=1e4, poisson=poisson)))
    x = system.rest_positions + 0.01 * np.random.default_rng(1).normal(size=BAR.vertices.shape)
    elasticity = elasticity_of(system)
    assert elasticity.value(x) > 0.0
    assert elasticity.energies(x).sum() == pytest.approx(elasticity.value(x), rel=1e-12)
    assert elasticity.value(system.rest_positions) == pytest.approx(0.0, abs=1e-12)
    assert_derivatives(elasticity, system, x, 1.0)


def test_laws_act_at_the_points_of_quadratic_tets():
    """Rubber, and tissue with a direction for each tet: derivatives, and the stress of a uniform stretch."""
    rubber = sp.MooneyRivlin(c10=3e3, c01=1e3, bulk=2e5)
    tissue = sp.HolzapfelGasserOgden(c10=3e3, bulk=2e5, k1=5e3, k2=1.0, directions=[[1.0, 0.5, 0.2]])
    for material in (rubber, tissue):
        system = build_system(bar_scene(material))
        x = system.rest_positions + 0.01 * np.random.default_rng(1).normal(size=BAR.vertices.shape)
        elasticity = elasticity_of(system)
        assert elasticity.energies(x).sum() == pytest.approx(elasticity.value(x), rel=1e-12)
        assert_derivatives(elasticity, system, x, 1.0)
        stretched = system.rest_positions * [1.2, 0.95, 0.9]
        linear = build_system(bar_scene(material, mesh=BAR.to_order(1)))
        corners = linear.rest_positions * [1.2, 0.95, 0.9]
        # The straight tets have another volume than the curved ones; the energy density is the same everywhere.
        densities = [
            elasticity_of(item).value(y) / item.laws.volumes.sum()
            for item, y in ((system, stretched), (linear, corners))
        ]
        assert densities[0] == pytest.approx(densities[1], rel=1e-9)


def test_derivatives_of_damping_and_of_the_barrier():
    system = build_system(bar_scene())
    random = np.random.default_rng(1)
    x = system.rest_positions + 0.01 * random.normal(size=BAR.vertices.shape)
    elasticity = elasticity_of(system)
    viscosity = quadratic_viscosity_of(elasticity)
    assert viscosity is not None
    rate = StrainRate(50.0, viscosity.strains(system.rest_positions))
    assert_derivatives(viscosity.damping(rate), system, x, 1.0)
    barrier = InversionGuard.at(system, x).quadratic_barrier(0.9)
    assert barrier is not None
    assert barrier.value(x) > 0.0
    assert barrier.value(system.rest_positions) == 0.0
    assert barrier.value(x * [1.0, 1.0, -1.0]) == np.inf
    assert_derivatives(barrier, system, x, 1.0)


def test_a_linear_body_beside_a_quadratic_one_has_its_own_energy():
    """The sum of both, and the bits of the linear one are those that it has alone."""
    linear = sp.Body("linear", sp.shapes.box((0.2, 0.2, 0.2), (1, 1, 1)), SOFT, position=(1, 0, 0))
    both = build_system(sp.Scene([linear, sp.Body("bar", BAR, SOFT)]))
    alone = [build_system(sp.Scene([body])) for body in both.scene.bodies]
    x = both.rest_positions + 0.01 * np.random.default_rng(2).normal(size=both.rest_positions.shape)
    parts = [elasticity_of(s).energies(x[part.vertices]) for s, part in zip(alone, both.bodies, strict=True)]
    np.testing.assert_array_equal(elasticity_of(both).energies(x), np.concatenate(parts))


def test_masses_are_positive_and_those_of_the_volume():
    system = build_system(bar_scene())
    assert (system.masses > 0.0).all()
    assert system.masses.sum() == pytest.approx(1000.0 * BAR.volume, rel=1e-12)
    straight = sp.shapes.box((1, 1, 1), (1, 1, 1), order=2)
    shares = build_system(sp.Scene([sp.Body("b", straight, SOFT)])).masses
    tets = 1000.0 * straight.volumes
    expected = np.bincount(straight.nodes.ravel(), np.outer(tets, [1 / 36] * 4 + [4 / 27] * 6).ravel())
    np.testing.assert_allclose(shares, expected, rtol=1e-12)


@pytest.mark.parametrize("integrator", ["backward_euler", "bdf2", "newmark"])
def test_free_bodies_fall_and_keep_their_momenta(integrator):
    body = sp.Body("bar", BAR, SOFT, velocity=(1, 0, 0), angular_velocity=(0, 3, 1))
    solver = sp.Implicit(integrator=integrator, contact=None)
    first = sp.simulate(sp.Scene([body]), solver, 0.01, 6)
    frames = list(first)
    assert all(frame.report.status == "converged" for frame in frames)
    m = frames[0].system.masses
    start = m @ BAR.vertices / m.sum()
    steps = np.arange(1, 7)
    fall = {"backward_euler": -9.81e-4 * steps * (steps + 1) / 2, "newmark": -9.81e-4 * steps**2 / 2}
    for k, frame in enumerate(frames):
        center = m @ frame.positions["bar"] / m.sum() - start
        assert center[0] == pytest.approx(0.01 * (k + 1), rel=1e-9)
        if integrator in fall:
            assert center[1] == pytest.approx(fall[integrator][k], rel=1e-9)
    if integrator == "newmark":
        spins = [frame.report.angular_momentum for frame in frames]
        np.testing.assert_allclose(spins, np.tile(spins[0], (6, 1)), rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize(
    ("material", "order", "curvature", "error"),
    [(sp.StableNeoHookean, 1, 0.0, 1e-8), (sp.NeoHookean, 2, 0.0, 1e-8), (sp.NeoHookean, 2, 0.03, 1e-4)],
)
def test_affine_patch(material, order, curvature, error):
    """An affine motion of the boundary is that of the inside: exactly where sides are straight.

    The rule of four points is not exact for the gradients of curved elements, of degree 3.
    """
    linear, random = sp.shapes.box((1, 1, 1), (2, 2, 2)), np.random.default_rng(0)
    x = linear.vertices.copy()
    x[np.abs(x).max(axis=1) < 0.4] += 0.05
    mesh = sp.TetMesh(x, linear.tets).to_order(order)
    hull = np.unique(mesh.surface.triangles)
    inner = np.setdiff1d(np.arange(len(mesh.vertices)), hull)
    x = mesh.vertices.copy()
    x[inner] += curvature * random.uniform(-1, 1, (len(inner), 3))
    mesh = sp.TetMesh(x, mesh.nodes)
    A = np.array([[0.2, 0.1, 0.0], [-0.05, -0.1, 0.15], [0.0, 0.1, 0.05]])
    move = x[hull] @ A.T
    body = sp.Body("bar", mesh, material(youngs=1.0, poisson=0.45))
    scene = sp.Scene([body], pins=[sp.Pin("bar", hull, lambda t: t * move)], gravity=(0, 0, 0))
    frame = equilibrium(scene)
    assert np.abs(frame.positions["bar"] - x @ (np.eye(3) + A).T).max() < error
    if not curvature:
        J = np.linalg.det(np.eye(3) + A)
        stress, at_vertices = frame.stress["bar"], frame.stress.at_vertices["bar"]
        np.testing.assert_allclose(stress, np.broadcast_to(stress[0], stress.shape), atol=1e-8)
        np.testing.assert_allclose(at_vertices, np.broadcast_to(stress[0], at_vertices.shape), atol=1e-8)
        np.testing.assert_allclose(frame.det_F, J, rtol=1e-8)
        assert frame.report.min_det_F == pytest.approx(J, rel=1e-8)


@pytest.mark.parametrize("load", ["traction", "pressure"])
def test_uniform_loads_on_faces_make_a_uniform_stress(load):
    mesh = sp.shapes.box((1, 1, 1), (2, 1, 1), order=2)
    held = np.flatnonzero(np.abs(mesh.vertices).sum(axis=1) == 0.5)  # the middles of faces, where there is a vertex
    x, triangles = mesh.vertices, mesh.surface.triangles
    if load == "pressure":
        loads, expected = [sp.Pressure("b", 1e-5)], -1e-5 * np.eye(3)
    else:
        ends = [np.flatnonzero((s * x[triangles][:, :, 0] > 0.5 - 1e-9).all(axis=1)) for s in (1, -1)]
        loads = [sp.Traction("b", (s * 1e-5, 0, 0), rows) for s, rows in zip((1, -1), ends, strict=True)]
        expected = np.diag([1e-5, 0.0, 0.0])
    scene = sp.Scene(
        [sp.Body("b", mesh, sp.StableNeoHookean(youngs=1.0, poisson=0.3))],
        soft_targets=[sp.SoftTarget("b", held[:4], 1e-6)],
        loads=loads,
        gravity=(0, 0, 0),
    )
    stress = equilibrium(scene).stress["b"]
    np.testing.assert_allclose(stress, np.broadcast_to(expected, stress.shape), atol=3e-9)


def test_a_part_of_a_facet_can_be_loaded():
    mesh = sp.shapes.box((1, 1, 1), (1, 1, 1), order=2)
    area = 1.0 / 8.0
    scene = sp.Scene([sp.Body("b", mesh, SOFT)], loads=[sp.Traction("b", (1.0, 0, 0), [0, 5, 6])], gravity=(0, 0, 0))
    forces = np.zeros_like(mesh.vertices)
    for part in build_system(scene).loads:
        part.add_forces(mesh.vertices, 0.0, forces)
    assert forces.sum(axis=0) == pytest.approx([3 * area, 0, 0])


def test_tets_stay_positive_everywhere_under_a_crushing_motion():
    """A block is pressed to a fifth of its height within one step, and sheared."""
    mesh = sp.shapes.box((1, 1, 1), (2, 2, 2), order=2)
    x = mesh.vertices
    top, bottom = np.flatnonzero(x[:, 1] > 0.49), np.flatnonzero(x[:, 1] < -0.49)
    scene = sp.Scene(
        [sp.Body("b", mesh, sp.StableNeoHookean(youngs=1e4, poisson=0.3))],
        pins=[sp.Pin("b", bottom), sp.Pin("b", top, lambda t: t * np.array([0.5, -0.8, 0.2]))],
        gravity=(0, 0, 0),
    )
    frame = equilibrium(scene, status="crushed")  # the barrier holds nodes at the pinned edges
    assert 0.0 < frame.report.min_det_F < 0.05
    guard = InversionGuard.at(frame.system, frame.state.positions)
    assert guard.complete
    assert guard.allows(frame.state.positions)
    far = frame.state.positions + 0.3 * np.random.default_rng(0).normal(size=x.shape)
    assert not guard.allows(far)
    step, tet = guard.largest_step(frame.state.positions, far - frame.state.positions)
    assert 0.0 < step < 1.0
    assert guard.name(tet).endswith("of body 'b'")
    assert guard.allows(frame.state.positions + step * (far - frame.state.positions))


def test_a_quadratic_body_rests_on_a_floor_and_on_a_linear_one():
    soft = replace(SOFT, youngs=2e5)
    low = sp.Body("low", sp.shapes.sphere(0.2, 0.15, order=2), soft, position=(0, 0.2005, 0), friction=0.4)
    high = sp.Body("high", sp.shapes.box((0.2, 0.2, 0.2), (1, 1, 1)), soft, position=(0, 0.51, 0), friction=0.4)
    scene = sp.Scene([low, high], obstacles=[sp.HalfSpace((0, 0, 0), (0, 1, 0), friction=0.4)])
    *_, frame = sp.simulate(scene, sp.Implicit(), 0.02, 12)
    assert frame.report.status == "converged", frame.report.message
    assert frame.report.min_distance is not None
    assert frame.report.min_distance > 0.0
    details = frame.report.details
    assert isinstance(details, ImplicitDetails)
    forces = details.contact_forces
    weight = 9.81 * frame.system.masses.sum()
    assert 0.2 * weight < forces["low"][1] + forces["high"][1] < 5.0 * weight
    assert forces["high"][1] > 0.0


def test_what_cannot_be_simulated_is_refused_in_one_line():
    with pytest.raises(SolverError) as error:
        list(sp.simulate(bar_scene(), sp.XPBD(), 0.01, 1))
    assert "has quadratic tets; simulate it with Implicit, or give linear tets: mesh.to_order(1)" in str(error.value)
    with pytest.raises(SceneError) as error:
        sp.RigidBody("r", BAR, density=1000.0)
    assert "quadratic tets" in str(error.value)


@pytest.mark.slow
def test_any_number_of_threads_gives_the_same_bits():
    mesh = wavy(sp.shapes.box((1, 1, 1), (4, 4, 4), order=2))
    system = build_system(sp.Scene([sp.Body("b", mesh, SOFT)]))
    x = system.rest_positions + 0.01 * np.random.default_rng(0).normal(size=mesh.vertices.shape)
    results = []
    for alone in (True, False):
        blocks, gradient = HessianBlocks.zeros(len(system.tets), len(x)), np.zeros_like(x)
        with numba_threads(1 if alone else None):
            energy = elasticity_of(system).add_model(x, gradient, blocks, True)
            guard = InversionGuard.at(system, x)
            step = guard.largest_step(x, 0.1 * np.sin(40.0 * x))
        results.append((energy, gradient.tobytes(), blocks.patches[0].blocks.tobytes(), step))
    assert results[0] == results[1]
    assert results[0][3][0] < 1.0
