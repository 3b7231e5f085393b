"""Each constraint set alone: rest, statics, oscillation and damping, against closed forms."""

import logging

import numpy as np
import pytest

import supple as sp
from supple.errors import SolverError
from supple.model.system import build_system, initial_state
from supple.solvers.xpbd.solver import XPBD

# One tet with a base of two rectangular sides, and a top above its corner: y is the normal of the held base.
TET = sp.TetMesh([[0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1, 0]], [[0, 1, 2, 3]])
TOP = int(np.flatnonzero(TET.vertices[:, 1] == 1.0)[0])
BASE = [k for k in range(4) if k != TOP]


def held_tet(material, **more):
    return sp.Scene(bodies=[sp.Body("tet", TET, material)], pins=[sp.Pin("tet", BASE)], **more)


def displacements(scene, solver, dt, steps, start):
    """The displacement of the top (steps, 3) after its release at `start` (3,) [m]."""
    x = TET.vertices.copy()
    x[TOP] += start
    system = build_system(scene)
    workspace, state = solver.prepare(system), initial_state(scene, positions={"tet": x})
    out = []
    for _ in range(steps):
        state, _ = solver.step(system, state, dt, workspace)
        out.append(state.positions[TOP] - TET.vertices[TOP])
    return np.array(out)


def decay_and_frequency(y, dt):
    """Rate [1/s] and angular frequency [rad/s] of a decaying cosine, from its maxima."""
    peaks = [k for k in range(1, len(y) - 1) if y[k - 1] < y[k] >= y[k + 1]]
    assert len(peaks) >= 4
    times, tops = dt * np.array(peaks), np.log(y[peaks])
    return -np.polyfit(times, tops, 1)[0], 2.0 * np.pi / np.diff(times).mean()


def stiffness_of_top(name):
    """(3, 3) [N/m] of small displacements of the top, with a fixed base; the tet's volume is 1/6, its height 1."""
    if name == "neo-hookean":
        mu, lam = 1e5 / 2.6, 1e5 * 0.3 / (1.3 * 0.4)
        return np.diag([mu, lam + 2.0 * mu, mu]) / 6.0
    directions = np.array([[0, 1, 0], [-1, 1, 0], [0, 1, -1]]) / np.sqrt([[1], [2], [2]])
    return directions.T @ directions / 1e-5 + np.diag([0.0, 1.0, 0.0]) / 36.0 / 1e-6


MATERIALS = {
    "neo-hookean": (sp.StableNeoHookean, {"youngs": 1e5, "poisson": 0.3}),
    "edges+volume": (sp.EdgesAndVolume, {"edge_compliance": 1e-5, "volume_compliance": 1e-6}),
}


@pytest.mark.parametrize(
    ("name", "mode"),
    [
        ("neo-hookean", 0),
        pytest.param("edges+volume", 2, marks=pytest.mark.slow),
        pytest.param("neo-hookean", 2, marks=pytest.mark.slow),
        pytest.param("edges+volume", 0, marks=pytest.mark.slow),
    ],
)
def test_a_damped_oscillator_has_the_analytic_frequency_and_decay(name, mode):
    """Kelvin-Voigt: x'' = -w^2 (x + tau x'), so the rate is tau w^2 / 2. The method itself damps like tau = h."""
    kind, constants = MATERIALS[name]
    squares, modes = np.linalg.eigh(stiffness_of_top(name) / (1000.0 / 24.0))
    omega = np.sqrt(squares[mode])
    dt = 2.0 * np.pi / omega / 50
    for tau in (0.0, 0.05 / omega):
        scene = held_tet(kind(**constants, damping=tau), gravity=(0, 0, 0))
        y = displacements(scene, XPBD(substeps=20), dt, 225, 1e-6 * modes[:, mode]) @ modes[:, mode]
        rate, frequency = decay_and_frequency(y, dt)
        assert frequency == pytest.approx(omega, rel=0.01)
        assert rate == pytest.approx(max(tau, dt / 20) * omega**2 / 2.0, rel=0.03)


@pytest.mark.parametrize("name", MATERIALS)
def test_a_force_deflects_a_tet_by_its_compliance(name):
    kind, constants = MATERIALS[name]
    force = np.array([1.0, -2.0, 0.5])
    load = sp.Force("tet", [TOP], force)
    scene = held_tet(kind(**constants, damping=0.1), forces=[load], gravity=(0, 0, 0))
    moved = displacements(scene, XPBD(substeps=50), 1 / 60, 60, np.zeros(3))[-1]
    expected = np.linalg.solve(stiffness_of_top(name), force)
    np.testing.assert_allclose(moved, expected, atol=0.01 * np.abs(expected).max())


@pytest.mark.parametrize("tau", [0.0, 0.05])
@pytest.mark.parametrize("kind", ["neo-hookean", "edges+volume"])
def test_rest_is_exact_and_damping_does_not_change_rigid_motion(kind, tau):
    """A body in rigid motion keeps its kinetic energy; a body at rest does not move."""
    ball = sp.shapes.sphere(radius=0.5, edge_length=0.33)
    material = {
        "neo-hookean": sp.StableNeoHookean(youngs=1e6, poisson=0.4, damping=tau),
        "edges+volume": sp.EdgesAndVolume(edge_compliance=1e-6, damping=tau),
    }[kind]
    for spin, tolerance in ((0.0, 1e-12), (2.0, 5e-3)):
        body = sp.Body("ball", ball, material, position=(1, 2, 3), velocity=(1, 0, 0), angular_velocity=(0, spin, 0))
        frames = list(sp.simulate(sp.Scene(bodies=[body], gravity=(0, 0, 0)), XPBD(contact=None), 1 / 60, 30))
        begin, end = frames[0].report.kinetic_energy, frames[-1].report.kinetic_energy
        assert end == pytest.approx(begin, rel=tolerance)
    assert np.abs(frames[-1].det_F - 1.0).max() < 1e-2


def test_values_per_tet_and_regions_are_taken_per_tet():
    """A bar that is soft in one half stretches there."""
    mesh = sp.shapes.box((0.1, 0.4, 0.1), (1, 8, 1))
    middle = mesh.vertices[mesh.tets][:, :, 1].mean(axis=1)
    lower = middle < mesh.vertices[:, 1].mean()
    per_tet = sp.StableNeoHookean(youngs=np.where(lower, 1e5, 1e6), poisson=0.3, damping=0.01)
    kinds = [sp.StableNeoHookean(youngs=E, poisson=0.3, damping=0.01) for E in (1e5, 1e6)]
    regions = sp.Regions(materials=kinds, index=np.where(lower, 0, 1))
    top = np.flatnonzero(mesh.vertices[:, 1] > mesh.vertices[:, 1].max() - 1e-9)
    ends = []
    for material in (per_tet, regions):
        scene = sp.Scene(bodies=[sp.Body("bar", mesh, material)], pins=[sp.Pin("bar", top)], gravity=(0, -100.0, 0))
        ends.append(list(sp.simulate(scene, XPBD(contact=None), 1 / 60, 40))[-1])
    np.testing.assert_array_equal(ends[0].positions["bar"], ends[1].positions["bar"])
    assert ends[0].det_F[lower].max() - 1.0 > 3.0 * (ends[0].det_F[~lower].max() - 1.0)


def test_regions_of_a_material_that_xpbd_cannot_simulate_are_an_error():
    mixed = sp.Regions(
        materials=[sp.StableNeoHookean(youngs=1e4, poisson=0), sp.ARAP(youngs=1e4, poisson=0.3)], index=[0]
    )
    message = r"^XPBD: body 'tet' has regions of ARAP, which XPBD cannot simulate; use regions of StableNeoHookean, or"
    with pytest.raises(SolverError, match=message):
        XPBD().prepare(build_system(held_tet(mixed)))


def test_a_warning_names_a_body_too_stiff_for_its_substeps(caplog):
    scene = held_tet(sp.StableNeoHookean(youngs=1e12, poisson=0.3))
    with caplog.at_level(logging.WARNING, logger="supple"):
        frames = list(sp.simulate(scene, XPBD(substeps=2), 1 / 60, 3))
    # The first frame gains elastic energy too, and the next ones keep it.
    assert frames[-1].report.status == "energy_gained"
    assert "too soft" in frames[-1].report.message
    assert frames[-1].report.softening["tet"] > 0.99
    assert sum("too stiff" in record.message for record in caplog.records) == 1


@pytest.mark.parametrize("kind", ["neo-hookean", "edges+volume"])
@pytest.mark.parametrize("start", ["flat", "inverted", "scrambled"])
def test_a_body_recovers_from_any_start(kind, start):
    ball = sp.shapes.sphere(radius=0.5, edge_length=0.33)
    material = {
        "neo-hookean": sp.StableNeoHookean(youngs=1e5, poisson=0.4, damping=0.005),
        "edges+volume": sp.EdgesAndVolume(edge_compliance=1e-5, damping=0.005),
    }[kind]
    x = {
        "flat": ball.vertices * (1.0, 0.0, 1.0),
        "inverted": ball.vertices * (1.0, -0.5, 1.0),
        "scrambled": np.random.default_rng(1).uniform(-0.5, 0.5, ball.vertices.shape),
    }[start]
    scene = sp.Scene(bodies=[sp.Body("ball", ball, material)], gravity=(0, 0, 0))
    for frame in sp.simulate(scene, XPBD(contact=None), 1 / 60, 30, initial_positions={"ball": x}):
        assert frame.report.status == "converged"
        assert np.abs(frame.positions["ball"]).max() < 5.0
    if kind == "neo-hookean":
        assert frame.report.min_det_F > 0.9


def test_soft_targets_pull_like_springs():
    """A light body on a spring: k x = m g, and with a moving target it follows."""
    mesh = sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1))
    everywhere = np.arange(len(mesh.vertices))
    rise = sp.Keyframes(times=[0.0, 1.0], displacements=[[0, 0, 0], [0, 1, 0]])
    target = sp.SoftTarget("cube", everywhere, stiffness=200.0, motion=rise)
    # A cube of 1 kg on eight springs of 200 N/m each.
    material = sp.StableNeoHookean(youngs=1e5, poisson=0.3, damping=0.01)
    scene = sp.Scene(bodies=[sp.Body("cube", mesh, material)], soft_targets=[target])
    frames = list(sp.simulate(scene, XPBD(substeps=5, contact=None), 1 / 60, 240))
    moved = frames[-1].positions["cube"].mean(axis=0) - mesh.vertices.mean(axis=0)
    np.testing.assert_allclose(moved, [0.0, 1.0 - 9.81 / 1600.0, 0.0], atol=3e-4)
