"""Damping in XPBD: the decay of Kelvin-Voigt, rigid motion and momenta, no growth, the same bits after a restart."""

import numpy as np
import pytest
from scipy.linalg import eigh
from tests.scenes import at_start, converged

import supple as sp
from supple.model.system import build_system
from supple.solvers.xpbd.damping import kelvin_voigt
from supple.solvers.xpbd.damping.coarse_space import CoarseMatrix, vertex_groups
from supple.solvers.xpbd.damping.elements import matrices_of_springs, matrices_of_tets, viscous_springs, viscous_tets
from supple.solvers.xpbd.damping.kelvin_voigt import LONGEST_CYCLE, cycle_lengths
from supple.solvers.xpbd.solver import XPBD

DT = 1.0 / 60.0
YOUNGS, POISSON = 2e5, 0.3
BEAM = sp.shapes.box((0.4, 0.1, 0.1), (8, 2, 2))
BALL = sp.shapes.sphere(radius=0.5, edge_length=0.33)
HELD = np.flatnonzero(BEAM.vertices[:, 0] < BEAM.vertices[:, 0].min() + 1e-9)


def beam(tau, **more):
    material = sp.StableNeoHookean(youngs=YOUNGS, poisson=POISSON, damping=tau)
    return sp.Scene([sp.Body("beam", BEAM, material)], pins=[sp.Pin("beam", HELD)], gravity=(0, 0, 0), **more)


def assembled(vertices, matrices, n):
    K = np.zeros((3 * n, 3 * n))
    for nodes, matrix in zip(vertices, matrices, strict=True):
        dofs = (3 * nodes[:, None] + np.arange(3)).ravel()
        np.add.at(K, (dofs[:, None], dofs), matrix)
    return K


def viscosity(system, x, tau=1.0):
    """The matrix K (3n, 3n) at positions x, which is tau times the stiffness at rest."""
    w = system.inverse_masses
    tets, springs = viscous_tets(system, w), viscous_springs(system, w)
    K = assembled(tets.vertices, matrices_of_tets(x, tets.vertices, tets.constants(), 0.0), len(x))
    return K + assembled(springs.vertices, matrices_of_springs(x, springs.vertices, springs.constants(), 0.0), len(x))


@pytest.fixture(scope="module")
def first_mode():
    """The angular frequency [1/s] and shape (n, 3) of the beam's first bending mode, of unit modal mass."""
    system = build_system(beam(1.0))
    K = viscosity(system, BEAM.vertices.copy())
    free = np.flatnonzero(np.repeat(system.inverse_masses > 0.0, 3))
    squares, modes = eigh(K[np.ix_(free, free)], np.diag(np.repeat(system.masses, 3)[free]), subset_by_index=[0, 0])
    shape = np.zeros(K.shape[0])
    shape[free] = modes[:, 0]
    return np.sqrt(squares[0]), shape.reshape(-1, 3)


def released(omega, tau, t):
    """x'' + tau w^2 x' + w^2 x = 0 with x = 1, x' = 0 at t = 0."""
    half = 0.5 * tau * omega**2
    root = np.sqrt(complex(half**2 - omega**2))
    a, b = -half + root, -half - root
    return ((a * np.exp(b * t) - b * np.exp(a * t)) / (a - b)).real


def coordinate(scene, first_mode, substeps, steps):
    """Times, and the modal coordinate of the beam after its release from 1 mm."""
    _, shape = first_mode
    amplitude = 1e-3 / np.abs(shape).max()
    start = {"beam": BEAM.vertices + amplitude * shape}
    masses = build_system(scene).masses
    frames = list(sp.simulate(scene, XPBD(substeps=substeps, contact=None), DT, steps, initial_positions=start))
    moved = [np.einsum("i,ij,ij->", masses, shape, f.positions["beam"] - BEAM.vertices) / amplitude for f in frames]
    return np.array([f.time for f in frames]), np.array(moved)


@pytest.mark.parametrize("tau", [0.005, 0.02, 0.1, 1.0])
def test_a_beam_is_damped_as_kelvin_voigt_damps_it(first_mode, tau):
    """Underdamped, and overdamped, where the release creeps back with 1 / tau."""
    omega, _ = first_mode
    t, q = coordinate(beam(tau), first_mode, 40, 60)
    np.testing.assert_allclose(q, released(omega, tau, t), atol=0.03)


def test_a_part_of_the_elements_suffices_for_the_length_of_a_step(first_mode, monkeypatch):
    """In turn, and here in a body that has a few groups only."""
    monkeypatch.setattr(kelvin_voigt, "ENOUGH_GROUPS", 1)
    t, q = coordinate(beam(0.02), first_mode, 40, 60)
    np.testing.assert_allclose(q, released(first_mode[0], 0.02, t), atol=0.03)


def test_damping_below_the_own_damping_of_the_method_changes_nothing(first_mode):
    """XPBD damps like tau = h."""
    omega, _ = first_mode
    t, q = coordinate(beam(0.0), first_mode, 20, 40)
    np.testing.assert_array_equal(coordinate(beam(DT / 20), first_mode, 20, 40)[1], q)
    np.testing.assert_allclose(q, released(omega, DT / 20, t), atol=0.1)


def test_the_viscosity_at_rest_is_the_stiffness_of_the_material():
    material = sp.StableNeoHookean(youngs=YOUNGS, poisson=POISSON, damping=1.0)
    system = build_system(sp.Scene([sp.Body("ball", BALL, material)]))
    K = viscosity(system, BALL.vertices.copy())
    H = material.hessian(np.eye(3))
    expected = np.zeros_like(K)
    for nodes, B, V in zip(system.tets, system.rest_shape_inverse, system.rest_volumes, strict=True):
        g = np.vstack([-B.sum(axis=0), B])
        # dF = sum_p u_p g_p^T, with F's entries row by row.
        D = np.einsum("ai,pj->ijpa", np.eye(3), g).reshape(9, 12)
        dofs = (3 * nodes[:, None] + np.arange(3)).ravel()
        np.add.at(expected, (dofs[:, None], dofs), V * D.T @ H @ D)
    np.testing.assert_allclose(K, expected, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("kind", ["neo-hookean", "edges+volume"])
def test_viscous_forces_dissipate_and_do_not_resist_rotations(kind):
    material = {
        "neo-hookean": sp.StableNeoHookean(youngs=YOUNGS, poisson=POISSON, damping=1.0),
        "edges+volume": sp.EdgesAndVolume(edge_compliance=1e-5, volume_compliance=1e-6, damping=1.0),
    }[kind]
    system = build_system(sp.Scene([sp.Body("ball", BALL, material)]))
    x = BALL.vertices * (1.3, 0.8, 1.1) + 0.02 * np.random.default_rng(0).standard_normal(BALL.vertices.shape)
    angle = 1.0
    R = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    turned = x @ R.T
    K = viscosity(system, 0.5 * (x + turned))
    eigenvalues = np.linalg.eigvalsh(K)
    assert np.abs(K - K.T).max() <= 1e-12 * eigenvalues[-1]
    assert eigenvalues[0] >= -1e-12 * eigenvalues[-1]
    # A finite rotation, as a displacement: no resistance about the positions in the middle.
    assert np.abs(K @ (turned - x).ravel()).max() <= 1e-12 * eigenvalues[-1]


def test_the_coarse_matrix_is_the_projected_one():
    system = build_system(beam(1.0))
    tets, x = viscous_tets(system, system.inverse_masses), BEAM.vertices
    rows = np.flatnonzero(system.inverse_masses > 0.0)
    groups = vertex_groups(rows, x, system.joined_components, system.components)
    H, h, n = 2e-3, 5e-4, len(x)
    matrices = matrices_of_tets(x, tets.vertices, tets.constants(), h)
    A = H * assembled(tets.vertices, matrices, n) + np.diag(np.repeat(system.masses, 3))
    count = len(groups.start) - 1
    assert count > 1
    Z = np.zeros((3 * n, 12 * count))
    for k, i in enumerate(groups.rows):
        for a in range(4):
            for j in range(3):
                Z[3 * i + j, 12 * groups.group_of[i] + 3 * a + j] = groups.fields[k, a]
    b = np.random.default_rng(1).standard_normal(12 * count)
    solved = b.copy()
    CoarseMatrix(groups, system.masses, [(tets.vertices, matrices)], H).solve(solved)
    np.testing.assert_allclose(Z.T @ A @ Z @ solved, b, atol=1e-8)


def test_a_spinning_body_of_any_damping_keeps_its_energy():
    material = sp.StableNeoHookean(youngs=1e6, poisson=0.4, damping=1.0)
    body = sp.Body("ball", BALL, material, velocity=(1, 0, 0), angular_velocity=(0, 5, 0))
    frames = list(sp.simulate(sp.Scene([body], gravity=(0, 0, 0)), XPBD(contact=None), DT, 60))
    undamped = sp.StableNeoHookean(youngs=1e6, poisson=0.4)
    body = sp.Body("ball", BALL, undamped, velocity=(1, 0, 0), angular_velocity=(0, 5, 0))
    other = list(sp.simulate(sp.Scene([body], gravity=(0, 0, 0)), XPBD(contact=None), DT, 60))
    assert frames[-1].report.kinetic_energy == pytest.approx(other[-1].report.kinetic_energy, rel=2e-3)


@pytest.mark.parametrize("tau", [0.01, 1.0])
def test_a_damped_free_body_keeps_both_momenta(tau):
    material = sp.StableNeoHookean(youngs=1e5, poisson=0.4, damping=tau)
    body = sp.Body("ball", BALL, material, velocity=(0.5, 0, 0), angular_velocity=(1, 3, 0))
    scene = sp.Scene([body], gravity=(0, 0, 0))
    flat = {"ball": BALL.vertices * (1.0, 0.6, 1.0)}
    first = at_start(scene, positions=flat)
    P, L = first.linear_momentum, first.angular_momentum
    for frame in sp.simulate(scene, XPBD(contact=None), DT, 60, initial_positions=flat):
        assert np.abs(frame.report.linear_momentum - P).max() <= 1e-9 * np.abs(P).max()
        assert np.abs(frame.report.angular_momentum - L).max() <= 1e-9 * np.abs(L).max()


@pytest.mark.parametrize("tau", [0.005, 0.05, 1.0, 10.0])
def test_damping_never_drives_a_body_far_from_rest(tau):
    """Released from random positions, where strains change wholly within a substep."""
    material = sp.StableNeoHookean(youngs=1e5, poisson=0.4, damping=tau)
    x = np.random.default_rng(1).uniform(-0.5, 0.5, BALL.vertices.shape)
    scene = sp.Scene([sp.Body("ball", BALL, material)], gravity=(0, 0, 0))
    frames = converged(sp.simulate(scene, XPBD(contact=None), DT, 60, initial_positions={"ball": x}))
    energies = [frame.report.kinetic_energy for frame in frames]
    assert max(np.abs(frame.positions["ball"]).max() for frame in frames) < 2.5
    assert energies[-1] < 0.01 * max(energies)


def test_a_run_that_continues_from_a_frame_has_the_same_bits():
    material = sp.StableNeoHookean(youngs=YOUNGS, poisson=POISSON, damping=0.05)
    scene = sp.Scene([sp.Body("beam", BEAM, material)], pins=[sp.Pin("beam", HELD)])
    solver = XPBD(substeps=10)
    whole = list(sp.simulate(scene, solver, DT, 12))
    again = list(sp.simulate(scene, solver, DT, 12 - whole[4].index, start=whole[4]))
    np.testing.assert_array_equal(again[-1].state.positions, whole[-1].state.positions)
    np.testing.assert_array_equal(again[-1].state.velocities, whole[-1].state.velocities)


@pytest.mark.parametrize("substeps", [1, 3, 4, 5, 20, 23])
def test_cycles_are_short_and_make_up_the_frame(substeps):
    lengths = cycle_lengths(substeps)
    assert sum(lengths) == substeps
    assert max(lengths) <= LONGEST_CYCLE
    assert max(lengths) - min(lengths) <= 1


@pytest.mark.parametrize("tau", [0.01, 0.1, 1.0, 100.0])
def test_no_mode_grows(tau):
    """Of a ball whose vertices begin with velocities at random. With cycles of 8 substeps, energies grow 50-fold."""
    v = 0.01 * np.random.default_rng(0).normal(size=BALL.vertices.shape)
    jelly = sp.StableNeoHookean(youngs=1e5, poisson=0.3, damping=tau)
    scene = sp.Scene([sp.Body("ball", BALL, jelly)], gravity=(0, 0, 0))
    frames = sp.simulate(scene, XPBD(substeps=8, contact=None), DT, 30, initial_velocities={"ball": v})
    energies = [frame.report.kinetic_energy + frame.report.elastic_energy for frame in frames]
    assert max(energies) == energies[0]
    assert energies[-1] < 0.25 * energies[0]
