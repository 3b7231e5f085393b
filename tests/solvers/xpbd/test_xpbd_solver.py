"""The XPBD solver as a whole: parameters, pins, mixed scenes, threads, and states that cannot be continued."""

from contextlib import nullcontext

import numba
import numpy as np
import pytest

import supple as sp
from supple.errors import SolverError
from supple.model.state import State
from supple.model.system import build_system, initial_state
from supple.runtime import thread_tuning
from supple.runtime.thread_tuning import ThreadTuner
from supple.solvers.xpbd.contact.settings import XPBDContact
from supple.solvers.xpbd.solver import XPBD
from supple.solvers.xpbd.sweeps import ordering

DT = 1.0 / 60.0
CUBE = sp.shapes.box((1.0, 1.0, 1.0), (3, 3, 3))
JELLY = sp.StableNeoHookean(youngs=1e5, poisson=0.4)
CLASSIC = sp.EdgesAndVolume(edge_compliance=1e-4)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"substeps": 0}, "substeps is 0"),
        ({"substeps": 2.5}, "substeps is 2.5"),
        ({"substeps": True}, "substeps is True"),
        ({"threads": 0}, "threads is 0"),
        ({"threads": 100000}, "threads is 100000"),
        ({"momentum_restore": 1}, "momentum_restore is 1"),
        ({"contact": True}, "contact is True"),
    ],
)
def test_wrong_parameters_raise_an_error(parameters, message):
    with pytest.raises(SolverError, match=message):
        XPBD(**parameters)


def test_a_solver_is_frozen_and_keeps_its_contact_settings():
    assert XPBD().contact == XPBDContact()
    assert XPBD(contact=None).contact is None
    with pytest.raises(AttributeError):
        XPBD().substeps = 3  # pyright: ignore[reportAttributeAccessIssue]


def test_an_error_names_the_body_whose_material_has_no_constraints():
    scene = sp.Scene(bodies=[sp.Body("pillow", CUBE, sp.ARAP(youngs=1e4, poisson=0.3))])
    with pytest.raises(
        SolverError, match=r"^XPBD: body .pillow. has the material ARAP, .* use EdgesAndVolume or StableNeoHookean, or"
    ):
        XPBD().prepare(build_system(scene))


def test_free_fall():
    """Substeps of backward Euler: n of them fall g h^2 n (n + 1) / 2."""
    scene = sp.Scene(bodies=[sp.Body("cube", CUBE, JELLY, velocity=(1.0, 0.0, 0.0))])
    frames = list(sp.simulate(scene, XPBD(substeps=10), DT, 6))
    n, h = 60, DT / 10
    expected = np.add(CUBE.vertices, (1.0 * n * h, -9.81 * h**2 * n * (n + 1) / 2, 0.0))
    np.testing.assert_allclose(frames[-1].positions["cube"], expected, atol=1e-12)
    np.testing.assert_allclose(frames[-1].velocities["cube"], np.tile([1.0, -9.81 * n * h, 0.0], (64, 1)), atol=1e-10)
    assert frames[-1].report.iterations == 10


def test_pins_are_exact_and_moved_every_substep():
    held = np.flatnonzero(CUBE.vertices[:, 1] > CUBE.vertices[:, 1].max() - 1e-9)
    turn = sp.Keyframes(times=[0.0, 1.0], angles=[0.0, 3.0], axis=(0, 1, 0))
    body = sp.Body("cube", CUBE, CLASSIC, position=(5.0, 2.0, 1.0))
    scene = sp.Scene(bodies=[body], pins=[sp.Pin("cube", held, motion=turn)])
    for frame in sp.simulate(scene, XPBD(substeps=7), DT, 20):
        targets = frame.system.pin_targets(frame.time)
        np.testing.assert_allclose(frame.positions["cube"][held], targets, atol=1e-13)
        before = frame.system.pin_targets(frame.time - DT / 7)
        np.testing.assert_allclose(frame.velocities["cube"][held], (targets - before) / (DT / 7), atol=1e-8)


def test_a_step_does_not_change_the_given_state_and_starts_from_any():
    scene = sp.Scene(bodies=[sp.Body("cube", CUBE, JELLY, angular_velocity=(0, 3, 0))])
    system, solver = build_system(scene), XPBD()
    state = initial_state(scene)
    x, v = state.positions.copy(), state.velocities.copy()
    workspace = solver.prepare(system)
    first, _ = solver.step(system, state, DT, workspace)
    solver.step(system, first, DT, workspace)
    again, _ = solver.step(system, state, DT, workspace)
    np.testing.assert_array_equal(state.positions, x)
    np.testing.assert_array_equal(state.velocities, v)
    np.testing.assert_array_equal(first.positions, again.positions)
    np.testing.assert_array_equal(first.velocities, again.velocities)


def test_bodies_of_mixed_materials_behave_as_each_alone():
    """Bodies that do not touch share kernels, colors and threads, and do not influence each other."""
    soft = sp.EdgesAndVolume(edge_compliance=1e-2, damping=0.02)
    damped = sp.StableNeoHookean(youngs=5e4, poisson=0.3, damping=0.01)
    kinds = {"classic": CLASSIC, "soft": soft, "jelly": JELLY, "damped": damped}
    bodies = [sp.Body(name, CUBE, kind, position=(3.0 * k, 0, 0)) for k, (name, kind) in enumerate(kinds.items())]
    held = [sp.Pin(body.name, vertices=[0, 1, 2]) for body in bodies]
    together = list(sp.simulate(sp.Scene(bodies=bodies, pins=held), XPBD(contact=None), DT, 20))[-1]
    for body, pin in zip(bodies, held, strict=True):
        alone = list(sp.simulate(sp.Scene(bodies=[body], pins=[pin]), XPBD(contact=None), DT, 20))[-1]
        # Equal up to the round-off of the component's origin and the order of the constraints.
        np.testing.assert_allclose(together.positions[body.name], alone.positions[body.name], atol=1e-3)
    moved = [
        np.abs(together.positions[name] - b.place(CUBE.vertices)).max() for name, b in zip(kinds, bodies, strict=True)
    ]
    assert moved[1] > 1.05 * moved[0]


def test_the_number_of_threads_does_not_change_a_bit(monkeypatch):
    monkeypatch.setattr(ordering, "SMALLEST_CHUNK", 100)
    materials = {
        "jelly": sp.StableNeoHookean(youngs=1e5, poisson=0.4, damping=0.02),
        "classic": sp.EdgesAndVolume(edge_compliance=1e-4, damping=0.01),
    }
    mesh = sp.shapes.box((1.0, 1.0, 3.0), (4, 4, 12))
    bodies = [
        sp.Body(
            name, mesh, material, position=(100.0 + 3.0 * k, 0.6, 0.0), velocity=(0, -2, 0), angular_velocity=(3, 2, 1)
        )
        for k, (name, material) in enumerate(materials.items())
    ]
    scene = sp.Scene(bodies=bodies, obstacles=[sp.HalfSpace(friction=0.3)])
    runs = [list(sp.simulate(scene, XPBD(substeps=8, threads=threads), DT, 10))[-1] for threads in (1, 2)]
    np.testing.assert_array_equal(runs[0].state.positions, runs[1].state.positions)
    np.testing.assert_array_equal(runs[0].state.velocities, runs[1].state.velocities)
    assert runs[0].report.details.contacts > 0


@pytest.mark.parametrize("material", [JELLY, CLASSIC], ids=["neo-hookean", "edges+volume"])
def test_diverging_positions_end_the_simulation_with_the_last_good_state(material):
    other = sp.Body("other", CUBE, JELLY, position=(5.0, 0.0, 0.0))
    scene = sp.Scene(bodies=[other, sp.Body("cube", CUBE, material)], obstacles=[sp.HalfSpace(point=(0, -9, 0))])
    v = np.zeros_like(CUBE.vertices)
    v[13] = (1e300, 0, 0)
    frames = list(sp.simulate(scene, XPBD(), DT, 5, initial_velocities={"cube": v}))
    assert len(frames) == 1
    assert frames[0].report.status == "not_finite"
    assert "body 'cube', vertex" in frames[0].report.message
    assert frames[0].time == 0.0
    assert np.isfinite(frames[0].state.positions).all()


def test_a_state_that_is_not_finite_is_reported():
    scene = sp.Scene(bodies=[sp.Body("cube", CUBE, JELLY)], obstacles=[sp.HalfSpace()])
    system, solver = build_system(scene), XPBD()
    state = initial_state(scene)
    x = state.positions.copy()
    x[5, 1] = np.nan
    _, report = solver.step(system, State(0.0, x, state.velocities), DT, solver.prepare(system))
    assert report.status == "not_finite"


def test_edges_and_volume_without_volume_compliance_keep_the_volume():
    """A ball compressed to half its height between plates: its volume stays within 1 % in every frame."""
    ball = sp.shapes.sphere(radius=0.5, edge_length=0.2)

    def plate(side):
        squeeze = sp.Keyframes(
            times=[0.0, 1.0, 1.5], displacements=[[0, 0, 0], [0, -0.25 * side, 0], [0, -0.25 * side, 0]]
        )
        return sp.HalfSpace(point=(0, 0.5 * side, 0), normal=(0, -side, 0), motion=squeeze)

    material = sp.EdgesAndVolume(edge_compliance=1e-3)
    scene = sp.Scene(bodies=[sp.Body("ball", ball, material)], obstacles=[plate(1), plate(-1)], gravity=(0, 0, 0))
    for frame in sp.simulate(scene, XPBD(contact=None), DT, 90):
        volume = frame.det_F @ ball.volumes
        assert volume == pytest.approx(ball.volume, rel=0.01)
    assert np.ptp(frame.positions["ball"][:, 1]) < 0.55


def clocked(pace, seconds, count=4000):
    """The choices of a `Pace` over substeps that take seconds(k, way)."""
    choices = []
    for k in range(count):
        way = pace.choose()
        choices.append(way)
        pace.note(way, seconds(k, way))
    return choices


def test_work_that_varies_does_not_count(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(thread_tuning, "perf_counter", lambda: now[0])
    monkeypatch.setattr(ThreadTuner, "threads", lambda self, parallel, threads: nullcontext(modes.append(parallel)))
    pace, modes, varying = ThreadTuner(True, True, 40), [], np.random.default_rng(0)
    for _ in pace.tasks(400, 2):
        pace.untimed = float(varying.uniform(0.0, 100.0))
        now[0] += (1.0 if modes[-1] else 2.0) + pace.untimed
    assert sum(modes) > 370


def test_the_pace_takes_the_faster_way():
    assert sum(clocked(ThreadTuner(True, True), lambda k, way: 1.0 if way else 2.0)) > 3980
    assert sum(clocked(ThreadTuner(True, True), lambda k, way: 9.0 if way else 2.0)) < 20


def test_the_pace_follows_a_machine_that_becomes_busy_and_quiet_again():
    choices = clocked(
        ThreadTuner(True, True), lambda k, way: (30.0 if 1000 <= k < 2000 else 1.0) if way else 2.0, 20_000
    )
    assert sum(choices[:1000]) > 990
    assert sum(choices[1000:2000]) < 30
    assert sum(choices[10_000:]) > 9900


def test_the_pace_is_not_misled_by_single_tasks():
    """One task in ten takes a thousand times as long: it includes a compilation, or was interrupted."""
    slow = clocked(ThreadTuner(True, True), lambda k, way: 1000.0 if k % 10 == 7 else 9.0 if way else 2.0)
    fast = clocked(ThreadTuner(True, True), lambda k, way: 1000.0 if k % 10 == 7 else 1.0 if way else 2.0)
    assert sum(slow) < 40
    assert sum(fast) > 3960


def test_the_pace_has_no_say_where_there_is_no_choice():
    assert all(clocked(ThreadTuner(False, True), lambda k, way: 9.0 if way else 1.0))
    assert not any(clocked(ThreadTuner(False, False), lambda k, way: 9.0 if way else 1.0))


def test_the_way_of_a_substep_holds_for_all_its_kernels(monkeypatch):
    """Also for those that search contacts: on a busy machine, each of them would wait for another thread."""
    monkeypatch.setattr("supple.solvers.xpbd.solver.PARALLEL_FROM", 0)
    used, before = [], numba.get_num_threads()
    push = sp.Force("cube", [0], lambda time: used.append(numba.get_num_threads()) or (0.0, 0.0, 0.0))
    system = build_system(sp.Scene(bodies=[sp.Body("cube", CUBE, JELLY)], forces=[push]))
    solver = XPBD(substeps=3)
    workspace, state = solver.prepare(system), initial_state(system.scene)
    for way, count in ((True, before), (False, 1)):
        used.clear()
        workspace.pace = ThreadTuner(choice=False, parallel=way)
        solver.step(system, state, DT, workspace)
        assert set(used) == {count}
        assert numba.get_num_threads() == before
