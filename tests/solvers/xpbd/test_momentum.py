"""Limits of the momentum restore: a free body gains no drift and no spin in 60 s, 100 m from the origin."""

import numpy as np
import pytest

import supple as sp
from supple.model.diagnostics import measure
from supple.model.system import build_system, initial_state
from supple.solvers.xpbd.solver import XPBD

SPHERE = sp.shapes.sphere(radius=0.5, edge_length=0.33)
DT = 1.0 / 60.0
FAR = np.array([100.0, 100.0, -100.0])
JELLY = sp.StableNeoHookean(youngs=2e4, poisson=0.45)
CLASSIC = sp.EdgesAndVolume(edge_compliance=1e-4)


def run(scene, solver, steps, **start):
    """The first and the last state. Calls the solver directly, because reports of all frames take most of the time."""
    system = build_system(scene)
    workspace = solver.prepare(system)
    state = begin = initial_state(scene, **start)
    for _ in range(steps):
        state, report = solver.step(system, state, DT, workspace)
        assert report.status == "converged", report.message
    return system, begin, state


def angular_momentum_and_inertia(system, state):
    """L (3,) about the center of mass [kg m^2/s] and the inertia tensor (3, 3) [kg m^2]."""
    m, x = system.masses, state.positions
    r = x - m @ x / m.sum()
    squares = np.einsum("ni,ni->n", r, r)[:, None, None] * np.eye(3)
    return m @ np.cross(r, state.velocities), np.einsum("n,nij->ij", m, squares - r[:, :, None] * r[:, None])


def spin(system, state):
    """Angular velocity (3,) of the whole scene about its center of mass [rad/s]."""
    L, inertia = angular_momentum_and_inertia(system, state)
    return np.linalg.solve(inertia, L)


def drift(system, state):
    """Speed of the center of mass [m/s]."""
    return np.linalg.norm(system.masses @ state.velocities) / system.masses.sum()


def squashed(material, height, position, mesh=SPHERE):
    body = sp.Body("ball", mesh, material, position=position)
    x = body.place(mesh.vertices)
    x[:, 1] = position[1] + height * (x[:, 1] - position[1])
    return sp.Scene(bodies=[body], gravity=(0, 0, 0)), {"ball": x}


@pytest.mark.parametrize(
    ("material", "height", "substeps", "seconds"),
    [
        (JELLY, 0.02, 5, 10),
        pytest.param(JELLY, 0.95, 80, 60, id="neo-hookean .95", marks=pytest.mark.slow),
        pytest.param(JELLY, 0.5, 20, 60, id="neo-hookean .5", marks=pytest.mark.slow),
        pytest.param(JELLY, 0.02, 5, 60, id="neo-hookean pancake", marks=pytest.mark.slow),
        pytest.param(CLASSIC, 0.95, 5, 60, id="edges+volume .95", marks=pytest.mark.slow),
        pytest.param(CLASSIC, 0.8, 40, 60, id="edges+volume .8", marks=pytest.mark.slow),
        pytest.param(CLASSIC, 0.5, 20, 60, id="edges+volume .5", marks=pytest.mark.slow),
        pytest.param(CLASSIC, 0.02, 20, 60, id="edges+volume pancake", marks=pytest.mark.slow),
    ],
)
def test_a_squashed_and_released_sphere_does_not_spin(material, height, substeps, seconds):
    scene, start = squashed(material, height, FAR)
    system, _, state = run(scene, XPBD(substeps=substeps, contact=None), 60 * seconds, positions=start)
    assert np.linalg.norm(spin(system, state)) <= 1e-9
    assert drift(system, state) <= 1e-10
    assert measure(system, state).min_det_F > 0.9, "the sphere has recovered"


def test_a_sphere_spins_without_momentum_restore():
    scene, start = squashed(CLASSIC, 0.5, np.zeros(3))
    system, _, state = run(scene, XPBD(momentum_restore=False, contact=None), 120, positions=start)
    assert np.linalg.norm(spin(system, state)) > 0.1


@pytest.mark.parametrize(
    ("substeps", "seed", "seconds"),
    [pytest.param(5, None, 60, marks=pytest.mark.slow), pytest.param(20, 1, 20, marks=pytest.mark.slow), (40, 2, 1)],
    ids=["5 substeps", "20", "40"],
)
def test_frictionless_plates_cause_no_spin(substeps, seed, seconds):
    """With the constraints in the mesh's order and in random ones."""
    mesh = SPHERE
    if seed is not None:
        order = np.random.default_rng(seed).permutation(len(mesh.tets))
        mesh = sp.TetMesh(mesh.vertices, mesh.tets[order])

    def plate(side):
        def motion(t):
            return (0.0, -side * 0.15 * (1.0 - np.cos(2.0 * np.pi * t)), 0.0)

        return sp.HalfSpace(point=np.add(FAR, (0.0, 0.52 * side, 0.0)), normal=(0.0, -side, 0.0), motion=motion)

    body = sp.Body("ball", mesh, CLASSIC, position=FAR)
    scene = sp.Scene(bodies=[body], obstacles=[plate(1), plate(-1)], gravity=(0, 0, 0))
    solver = XPBD(substeps=substeps, contact=None)
    system = build_system(scene)
    workspace, state = solver.prepare(system), initial_state(scene)
    worst, lowest = 0.0, 1.0
    for _ in range(60 * seconds):
        state, _ = solver.step(system, state, DT, workspace)
        L, inertia = angular_momentum_and_inertia(system, state)
        # The forces of the plates may have a moment about the other axes.
        worst = max(worst, abs(L[1]) / inertia[1, 1])
        lowest = min(lowest, np.ptp(state.positions[:, 1]))
    assert worst <= 1e-10
    assert lowest < 0.75, "the plates have compressed the sphere"


@pytest.mark.parametrize("position", [(0.0, 0.0, 0.0), FAR], ids=["origin", "far"])
def test_a_free_spin_keeps_its_angular_momentum(position):
    body = sp.Body("ball", SPHERE, JELLY, position=position, angular_velocity=(1.0, 4.0, 2.8))
    system, begin, state = run(sp.Scene(bodies=[body], gravity=(0, 0, 0)), XPBD(contact=None), 300)
    first, _ = angular_momentum_and_inertia(system, begin)
    final, _ = angular_momentum_and_inertia(system, state)
    assert np.linalg.norm(final - first) <= 1e-9 * np.linalg.norm(first)


def test_a_rigid_spin_without_momentum_restore_decays_as_predicted():
    """1 / w^2 = 1 / w0^2 + 2 h t."""
    substeps, seconds, w0 = 20, 5.0, 5.0
    body = sp.Body("ball", SPHERE, sp.EdgesAndVolume(), angular_velocity=(0.0, w0, 0.0))
    solver = XPBD(substeps=substeps, momentum_restore=False, contact=None)
    system, _, state = run(sp.Scene(bodies=[body], gravity=(0, 0, 0)), solver, round(seconds / DT))
    expected = (1.0 / w0**2 + 2.0 * DT / substeps * seconds) ** -0.5
    assert np.linalg.norm(spin(system, state)) == pytest.approx(expected, rel=0.01)


def test_momentum_is_restored_for_every_free_component_and_no_pinned_one():
    """Two free balls in one body and a pinned one in another: gravity acts on all, momentum is exact for the free."""
    two = sp.TetMesh(
        np.concatenate([SPHERE.vertices, np.add(SPHERE.vertices, (3.0, 0.0, 0.0))]),
        np.concatenate([SPHERE.tets, SPHERE.tets + len(SPHERE.vertices)]),
    )
    pair = sp.Body("pair", two, CLASSIC)
    held = sp.Body("held", SPHERE, JELLY, position=(0.0, 5.0, 0.0))
    scene = sp.Scene(bodies=[pair, held], pins=[sp.Pin("held", vertices=[0])])
    x = pair.place(two.vertices)
    x[: len(SPHERE.vertices), 1] *= 0.6
    system, _, state = run(scene, XPBD(contact=None), 60, positions={"pair": x})
    velocities = system.split(state.velocities)
    for half in (slice(None, len(SPHERE.vertices)), slice(len(SPHERE.vertices), len(two.vertices))):
        m, v = system.masses[half], velocities["pair"][half]
        np.testing.assert_allclose(m @ v / m.sum(), [0.0, -9.81, 0.0], atol=1e-11)
    assert np.linalg.norm(velocities["held"][0]) == 0.0
    assert np.linalg.norm(velocities["held"]) > 0.01
