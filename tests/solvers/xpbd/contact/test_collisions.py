"""Collisions as a whole: settings, same bits, and what is reported."""

import numba
import numpy as np
import pytest

import supple as sp
from supple.errors import SolverError
from supple.model.system import build_system, initial_state
from supple.runtime.threads import numba_threads
from supple.solvers.xpbd.contact import surface_collisions
from supple.solvers.xpbd.contact.collisions import Collisions
from supple.solvers.xpbd.contact.settings import XPBDContact
from supple.solvers.xpbd.solver import XPBD

SOFT = sp.StableNeoHookean(youngs=5e4, poisson=0.4, density=1000)


def pile():
    mesh = sp.shapes.box((0.2, 0.1, 0.2), (2, 1, 2))
    bodies = [
        sp.Body(f"b{k}", mesh, SOFT, position=(0.02 * k, 0.07 + 0.13 * k, 0), rotation=(0, 0.3 * k, 0), friction=0.3)
        for k in range(3)
    ]
    return sp.Scene(bodies, [sp.HalfSpace(friction=0.5), sp.obstacles.Sphere(center=(0.05, -0.022, 0), radius=0.04)])


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"thickness": 0.0}, "thickness is 0; it must be above zero"),
        ({"thickness": -1e-3}, "thickness"),
        ({"thickness": float("nan")}, "thickness"),
        ({"thickness": "thin"}, "'thin'"),
        ({"thickness": True}, "thickness"),
        ({"self_collision": 1}, "self_collision is 1"),
        ({"body_collision": None}, "body_collision"),
    ],
)
def test_wrong_settings_raise_an_error_that_names_them(wrong, message):
    with pytest.raises(SolverError, match=message) as caught:
        XPBDContact(**wrong)
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_the_result_has_the_same_bits_on_any_number_of_threads():
    def run(threads):
        return [f.state.positions for f in sp.simulate(pile(), XPBD(substeps=10, threads=threads), 1 / 60, 20)][-1]

    more = min(2, numba.config.NUMBA_NUM_THREADS)
    assert (run(1) == run(1)).all()
    assert (run(1) == run(more)).all()


def test_contacts_found_on_several_threads_have_the_same_bits(monkeypatch):
    """With the limit at one point, also small scenes search for contacts in parallel."""

    def run():
        scene = pile()
        system, state = build_system(scene), initial_state(scene)
        collisions = Collisions(system, XPBDContact())
        x, v, h = state.positions.copy(), state.velocities.copy(), 1 / 600
        contacts = 0
        for k in range(60):
            if k % 10 == 0:
                collisions.begin_step(x, v, k * h, 10 * h, collisions.memory(x) if k else None)
            before = x.copy()
            x = x + h * (v + h * np.array([0.0, -9.81, 0.0]))
            collisions.begin_substep(x, before, h)
            contacts += collisions.project(x, before, (k + 1) * h, h)
            collisions.end_substep()
            v = (x - before) / h
        return x, contacts

    monkeypatch.setattr(surface_collisions, "PARALLEL_FROM", 1)
    two = run()
    with numba_threads(1):
        one = run()
    assert (one[0] == two[0]).all()
    assert one[1] == two[1] > 0


def test_collisions_are_false_where_no_contact_is_possible():
    scene = sp.Scene(pile().bodies[:1])
    assert not Collisions(build_system(scene), None)
    assert Collisions(build_system(scene), XPBDContact())
    assert Collisions(build_system(pile()), None)
    frame = next(iter(sp.simulate(scene, XPBD(substeps=2, contact=None), 1 / 60, 1)))
    assert frame.report.details.smallest_gap is None


def test_bodies_stop_at_the_given_thickness():
    """Two boxes without gravity, driven together: they stop at the gap, and the report contains it."""
    mesh = sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1))
    for thickness in (2e-3, 8e-3):
        scene = sp.Scene(
            [sp.Body("a", mesh, SOFT), sp.Body("b", mesh, SOFT, position=(0.01, 0.12, 0.01), velocity=(0, -0.2, 0))],
            gravity=(0, 0, 0),
        )
        solver = XPBD(substeps=10, contact=XPBDContact(thickness=thickness))
        gaps = [f.report.details.smallest_gap for f in sp.simulate(scene, solver, 1 / 60, 20)]
        assert min(gaps) == pytest.approx(thickness, rel=0.02)
        assert gaps[0] == pytest.approx(0.02, abs=0.004)


def test_positions_that_are_not_finite_do_not_stop_the_program():
    scene = pile()
    system, state = build_system(scene), initial_state(scene)
    collisions = Collisions(system, XPBDContact())
    x, before = state.positions.copy(), state.positions.copy()
    collisions.begin_step(x, state.velocities, 0.0, 1 / 60)
    x[3] = np.nan
    x[40] = 1e200
    collisions.begin_substep(x, before, 1 / 600)
    collisions.project(x, before, 1 / 600, 1 / 600)
    collisions.end_substep()
    collisions.begin_step(x, np.full_like(x, np.inf), 0.0, 1 / 60)
    assert np.isnan(x[3]).all()


def test_contacts_far_from_the_origin_are_the_same():
    def drop(shift):
        body = sp.Body("b", sp.shapes.box((0.1, 0.1, 0.1), (2, 2, 2)), SOFT, position=np.array([0, 0.06, 0]) + shift)
        under = sp.Body("u", sp.shapes.box((0.3, 0.1, 0.3), (2, 2, 2)), SOFT, position=np.array([0, -0.05, 0]) + shift)
        floor = sp.HalfSpace(point=np.array([0, -0.1, 0]) + shift)
        frames = list(sp.simulate(sp.Scene([body, under], [floor]), XPBD(substeps=10), 1 / 60, 15))
        return frames[-1].state.positions - shift

    assert np.abs(drop(np.array([1000.0, 0.0, -2000.0])) - drop(np.zeros(3))).max() < 1e-5


def test_contacts_that_are_projected_again_in_a_substep_keep_their_forces():
    """The guard of volumes asks for it. Nothing has moved in between here."""

    def run(times):
        body = sp.Body("b", sp.shapes.box((0.2, 0.1, 0.2), (2, 1, 2)), SOFT, position=(0, 0.0505, 0))
        system = build_system(sp.Scene([body], [sp.HalfSpace(friction=0.5)]))
        state = initial_state(system.scene)
        collisions = Collisions(system, None)
        x, v, h = state.positions.copy(), state.velocities + np.array([0.1, 0.0, 0.0]), 1 / 600
        collisions.begin_step(x, v, 0.0, 1 / 60)
        for k in range(10):
            before = x.copy()
            x = x + h * (v + h * np.array([0.0, -9.81, 0.0]))
            collisions.begin_substep(x, before, h)
            x[:, 1] -= 50.0 * h * h  # as elastic forces that press the body down
            for _ in range(times):
                collisions.project(x, before, (k + 1) * h, h)
            collisions.end_substep()
            v = (x - before) / h
        return x, collisions.memory(x).obstacles.loads

    one, two = run(1), run(3)
    assert np.abs(one[1]).max() > 1.0
    assert one[0] == pytest.approx(two[0], abs=1e-12)
    assert one[1] == pytest.approx(two[1], abs=1e-6)
