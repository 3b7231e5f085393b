"""Large deformations, scripted pins, recovery, and states that are an error: the guarantees of the step filter."""

import re
from itertools import pairwise

import numpy as np
import pytest

import supple as sp
from supple.materials.elastic import NeoHookean
from supple.solvers.implicit.details import ImplicitDetails
from supple.solvers.implicit.solver import Implicit


def bar(material, divisions=(8, 2, 2), order=1):
    mesh = sp.shapes.box((1, 0.25, 0.25), divisions, order=order)
    X = mesh.vertices
    left, right = np.flatnonzero(X[:, 0] == X[:, 0].min()), np.flatnonzero(X[:, 0] == X[:, 0].max())
    return sp.Body("bar", mesh, material), left, right


def rubber():
    return NeoHookean(youngs=1e5, poisson=0.45)


def follow(scene, solver, dt, steps, *others):
    for frame in sp.simulate(scene, solver, dt, steps):
        assert frame.report.status in ("converged", *others), frame.report.message
        assert frame.report.min_det_F > 0
        yield frame


def pinned_exactly(frame):
    system = frame.system
    return np.array_equal(frame.state.positions[system.pinned_vertices], system.pin_targets(frame.time))


LARGE = pytest.param((36, 10, 10), marks=pytest.mark.slow, id="21600 tets")


@pytest.mark.parametrize("divisions", [(8, 2, 2), LARGE])
def test_a_bar_pressed_to_a_tenth_of_its_length(divisions):
    body, left, right = bar(rubber(), divisions)
    press = sp.Keyframes(times=[0, 0.5], displacements=[[0, 0, 0], [-0.9, 0, 0]])
    scene = sp.Scene([body], pins=[sp.Pin("bar", left), sp.Pin("bar", right, press)], gravity=(0, 0, 0))
    for frame in follow(scene, Implicit(contact=None), 1 / 60, 30):
        assert pinned_exactly(frame)
    assert np.ptp(frame.positions["bar"][np.concatenate([left, right]), 0]) == pytest.approx(0.1, abs=1e-12)


@pytest.mark.parametrize("material", [NeoHookean, sp.StableNeoHookean], ids=lambda m: m.__name__)
def test_a_bar_with_mean_volumes_turned_and_pressed(material):
    """The energy of a mean volume does not see a part of a quadratic tet invert; filter and barrier do."""
    body, left, right = bar(material(youngs=1e5, poisson=0.49), (4, 1, 1), order=2)
    press = sp.Keyframes(
        times=[0, 0.2],
        displacements=[[0, 0, 0], [-0.7, 0, 0]],
        angles=[0, np.pi],
        axis=(1, 0, 0),
        pivot=body.mesh.vertices.mean(axis=0),
    )
    scene = sp.Scene([body], pins=[sp.Pin("bar", left), sp.Pin("bar", right, press)], gravity=(0, 0, 0))
    for frame in follow(scene, Implicit(contact=None), 1 / 60, 12):
        assert pinned_exactly(frame)


@pytest.mark.parametrize("divisions", [(12, 3, 3), LARGE])
def test_a_bar_twisted_by_four_turns(divisions):
    body, left, right = bar(rubber(), divisions)
    turns = sp.Keyframes(times=[0, 1.2], angles=[0, 8 * np.pi], axis=(1, 0, 0), pivot=body.mesh.vertices.mean(axis=0))
    scene = sp.Scene([body], pins=[sp.Pin("bar", left), sp.Pin("bar", right, turns)], gravity=(0, 0, 0))
    for frame in follow(scene, Implicit(contact=None), 1 / 60, 72):
        assert pinned_exactly(frame)


def test_a_jump_of_the_pins_takes_one_frame():
    body, left, right = bar(rubber())
    jump = sp.Keyframes(times=[0, 0.01], displacements=[[0, 0, 0], [-0.6, 0.3, 0]])
    scene = sp.Scene([body], pins=[sp.Pin("bar", left), sp.Pin("bar", right, jump)], gravity=(0, 0, 0))
    for frame in follow(scene, Implicit(contact=None), 1 / 60, 2):
        assert pinned_exactly(frame)


def test_a_static_bar_is_pressed_in_few_steps():
    body, left, right = bar(rubber())
    press = sp.Keyframes(times=[0, 4], displacements=[[0, 0, 0], [-0.4, 0, 0]])
    scene = sp.Scene([body], pins=[sp.Pin("bar", left), sp.Pin("bar", right, press)], gravity=(0, 0, 0))
    for frame in follow(scene, Implicit(contact=None, integrator="static"), 1.0, 4):
        assert pinned_exactly(frame)
        assert np.abs(frame.velocities["bar"]).max() == 0.0


def test_pins_that_cannot_reach_their_targets_are_reported_by_name():
    body, left, right = bar(rubber(), (4, 1, 1))
    through = sp.Keyframes(times=[0, 0.2], displacements=[[0, 0, 0], [-2.0, 0, 0]])
    scene = sp.Scene(
        [body], pins=[sp.Pin("bar", left, name="wall"), sp.Pin("bar", right, through, name="ram")], gravity=(0, 0, 0)
    )
    frames = list(sp.simulate(scene, Implicit(contact=None, max_substeps=16), 1 / 60, 30))
    last = frames[-1]
    assert last.report.status == "blocked"
    assert not last.report.status.can_go_on
    assert re.search(r"pin '(ram|wall)' of body 'bar' is blocked", last.report.message)
    assert last.report.min_det_F > 0
    assert last.time < 0.12
    assert all(frame.report.status == "converged" for frame in frames[:-1])


def test_a_pin_that_inverts_a_tet_is_blocked():
    # All four vertices of a tet are scripted: no free vertex can help.
    body, _, _ = bar(rubber(), (2, 1, 1))
    tet = body.mesh.tets[0]
    low = body.mesh.vertices[tet]
    mirror = np.zeros((4, 3))
    mirror[:, 1] = -2 * (low[:, 1] - low[:, 1].mean())
    scene = sp.Scene([body], pins=[sp.Pin("bar", tet, lambda t: min(t * 30, 1.0) * mirror, name="hand")])
    last = list(sp.simulate(scene, Implicit(contact=None), 1 / 60, 5))[-1]
    assert last.report.status == "blocked"
    assert "pin 'hand' of body 'bar' is blocked" in last.report.message


@pytest.mark.parametrize("integrator", ["backward_euler", "newmark"])
def test_a_body_too_soft_for_its_weight_is_crushed_without_inverting(integrator):
    # Here the minimum of the stable Neo-Hookean energy is inverted: the barrier makes one before inversion.
    mesh = sp.shapes.box((1, 1, 1), (2, 3, 2))
    top = np.flatnonzero(mesh.vertices[:, 1] == mesh.vertices[:, 1].max())
    foot = np.flatnonzero(mesh.vertices[:, 1] == mesh.vertices[:, 1].min())
    soft = sp.Body("jelly", mesh, sp.StableNeoHookean(youngs=500, poisson=0.3))
    scene = sp.Scene([soft], pins=[sp.Pin("jelly", top), sp.Pin("jelly", foot)])
    frames = list(follow(scene, Implicit(contact=None, integrator=integrator), 1 / 60, 60, "crushed"))
    assert min(frame.report.min_det_F for frame in frames) < 0.1
    assert all((frame.report.status == "crushed") == (frame.report.min_det_F < 0.25) for frame in frames)


def scattered(mesh, seed):
    return np.random.default_rng(seed).uniform(0, 1, mesh.vertices.shape)


def shape_error(x, rest):
    """Largest distance of a vertex from the best rigid placement of the rest shape, relative to its size."""
    a, b = x - x.mean(axis=0), rest - rest.mean(axis=0)
    U, _, V = np.linalg.svd(a.T @ b)
    R = U @ np.diag([1, 1, np.linalg.det(U @ V)]) @ V
    return np.abs(a - b @ R.T).max() / np.ptp(rest, axis=0).max()


@pytest.mark.parametrize("seed", [0, 1])
def test_stable_neo_hookean_recovers_from_random_positions(seed):
    mesh = sp.shapes.box((1, 1, 1), (3, 3, 3))
    body = sp.Body("cube", mesh, sp.StableNeoHookean(youngs=1e5, poisson=0.4))
    scene = sp.Scene([body], gravity=(0, 0, 0))
    frames = list(
        sp.simulate(scene, Implicit(contact=None), 0.2, 60, initial_positions={"cube": scattered(mesh, seed)})
    )
    assert all(frame.report.status == "converged" for frame in frames)
    assert frames[0].index == 1
    assert frames[-1].report.min_det_F > 0.99
    assert shape_error(frames[-1].positions["cube"], mesh.vertices) < 1e-2


def test_stable_neo_hookean_recovers_from_a_plane():
    mesh = sp.shapes.box((1, 1, 1), (2, 2, 2))
    body = sp.Body("cube", mesh, sp.StableNeoHookean(youngs=1e5, poisson=0.4))
    scene = sp.Scene([body], gravity=(0, 0, 0))
    flat = mesh.vertices * np.array([1, 0, 1]) + 1e-9 * scattered(mesh, 0)
    last = list(sp.simulate(scene, Implicit(contact=None), 0.2, 40, initial_positions={"cube": flat}))[-1]
    assert last.report.status == "converged"
    assert shape_error(last.positions["cube"], mesh.vertices) < 1e-2


def test_inverted_neo_hookean_tets_are_an_error_that_lists_them():
    mesh = sp.shapes.box((1, 1, 1), (1, 1, 1))
    body = sp.Body("cube", mesh, rubber())
    x = mesh.vertices.copy()
    corner = mesh.tets[0][0]
    x[corner] = -1.5 * x[corner]
    det = np.linalg.det(np.stack([x[mesh.tets[:, k]] - x[mesh.tets[:, 0]] for k in (1, 2, 3)], axis=-1))
    bad = np.flatnonzero(det <= 0)
    assert len(bad)
    with pytest.raises(sp.SolverError, match=r"body 'cube'.*inverted.*tets " + ", ".join(map(str, bad[:10]))):
        list(sp.simulate(sp.Scene([body]), Implicit(contact=None), 1 / 60, 1, initial_positions={"cube": x}))


def test_a_body_that_has_recovered_is_guarded_from_then_on():
    mesh = sp.shapes.box((1, 1, 1), (2, 2, 2))
    body = sp.Body("cube", mesh, sp.StableNeoHookean(youngs=1e5, poisson=0.4))
    scene = sp.Scene([body], gravity=(0, 0, 0))
    start = {"cube": scattered(mesh, 5)}
    whole = np.array(
        [
            frame.report.min_det_F > 0
            for frame in sp.simulate(scene, Implicit(contact=None), 0.02, 60, initial_positions=start)
        ]
    )
    assert whole[-1]
    first = int(np.argmax(whole))
    assert first > 0
    assert whole[first:].all()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"integrator": "euler"}, "integrator is 'euler'; give 'backward_euler'"),
        ({"tolerance": 0.0}, "tolerance is 0; it must be above zero"),
        ({"tolerance": float("nan")}, "tolerance is nan"),
        ({"max_iterations": 0}, "max_iterations is 0"),
        ({"max_substeps": 1.5}, "max_substeps is 1.5"),
        ({"linear_solver": "lu"}, "linear_solver is 'lu'; give 'auto', 'pcg' or 'direct'"),
        ({"force_tolerance": 1.0}, "force_tolerance is 1; it must be above zero and below 1"),
        ({"path_tolerance": 0}, "path_tolerance is 0; it must be above zero"),
        ({"volume_kept": 0.0}, "volume_kept is 0; it must be above zero and below 1"),
        ({"barrier_onset": 1.1}, "barrier_onset is 1.1; it must be above zero and at most 1"),
        ({"barrier_onset": "low"}, "barrier_onset is 'low'"),
    ],
)
def test_invalid_parameters_are_errors(change, message):
    with pytest.raises(sp.SolverError, match=re.escape(message)):
        Implicit(**change)


def test_an_iteration_limit_is_reported_and_the_run_continues():
    body, left, right = bar(rubber())
    pull = sp.Keyframes(times=[0, 0.05], displacements=[[0, 0, 0], [1.5, 0.6, 0]])
    scene = sp.Scene([body], pins=[sp.Pin("bar", left), sp.Pin("bar", right, pull)])
    frames = list(sp.simulate(scene, Implicit(contact=None, max_iterations=4, max_substeps=1), 1 / 60, 3))
    assert len(frames) == 3
    assert all(frame.report.status == "iteration_limit" for frame in frames)
    assert "4 iterations;" in frames[0].report.message
    assert "N remain" in frames[0].report.message
    assert all(pinned_exactly(frame) for frame in frames)


def test_the_trace_has_a_row_for_every_iteration():
    body, left, right = bar(rubber())
    pull = sp.Keyframes(times=[0, 1], displacements=[[0, 0, 0], [0.5, 0.2, 0]])
    scene = sp.Scene([body], pins=[sp.Pin("bar", left), sp.Pin("bar", right, pull)])
    frames = list(follow(scene, Implicit(contact=None), 1 / 60, 3))
    details = [frame.report.details for frame in frames if isinstance(frame.report.details, ImplicitDetails)]
    rows = [row for item in details for row in item.newton]
    assert len(rows) == sum(d.newton_iterations + d.extension_iterations for d in details)
    assert {row.kind for row in rows} == {"newton", "extension"}
    assert all(0.0 < row.filter <= 1.0 and 0.0 < row.step <= 1.0 for row in rows)
    assert all(row.linear_iterations > 0 for row in rows if row.linear_solver == "pcg")
    newton = [row for row in rows if row.kind == "newton"]
    energies = [(a.energy, b.energy) for a, b in pairwise(newton) if b.iteration == a.iteration + 1]
    assert len(energies) > 1
    assert all(after <= before + 1e-9 * abs(before) for before, after in energies)
    assert [frame.report.iterations for frame in frames] == [item.newton_iterations for item in details]
