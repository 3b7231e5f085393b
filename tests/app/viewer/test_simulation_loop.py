"""The simulation loop without its process: failures, slow motion and views."""

import contextlib
import dataclasses
import logging
import math
import threading
import time
from collections import deque

import numpy as np
import pytest

import supple as sp
from supple.app.viewer.engine import simulation_loop
from supple.app.viewer.engine.pacing import Pacing
from supple.app.viewer.engine.step_watch import warnings_as_notices
from supple.app.viewer.protocol import commands
from supple.errors import SolverError
from supple.model.state import Status, StepReport
from supple.runtime.interruption import interruption_point


def with_solver_that(loop, step):
    """Replace the solver of the loop by one that calls `step`."""

    class Broken(type(loop.live.setup.solver)):
        def step(self, system, state, dt, workspace):
            return step(state)

    loop.live.setup = dataclasses.replace(loop.live.setup, solver=Broken())


def not_finite(state):
    return state, StepReport(Status.NOT_FINITE, 1, "vertex 7 is lost")


def silently_not_finite(state):
    bad = dataclasses.replace(state, positions=state.positions * math.nan)
    return bad, StepReport(Status.CONVERGED, 1)


def refuses(state):
    raise SolverError("tets are inverted")


def crashes(state):
    raise ValueError("a mistake in a solver")


@pytest.mark.parametrize("failure", [not_finite, silently_not_finite, refuses, crashes])
def test_a_failed_step_pauses_at_the_last_good_state_with_a_notice(loop, failure):
    loop.execute(commands.Play())
    loop.step()
    good = loop.live.state
    solver = loop.live.setup.solver
    with_solver_that(loop, failure)
    loop.step()
    assert not loop.playing
    assert loop.live.state is good
    assert loop.live.frame == 1
    notice = loop.notices[-1]
    assert notice.level == "error"
    assert notice.text.startswith("paused at t = 0.01667 s; ")
    loop.live.setup = dataclasses.replace(loop.live.setup, solver=solver)
    loop.execute(commands.Play())
    loop.step()
    assert loop.live.frame == 2


def endless(state):
    while True:
        time.sleep(0.01)
        interruption_point()


def stubborn(state):
    with contextlib.suppress(SolverError):
        endless(state)
    endless(state)


@pytest.mark.parametrize("endless", [endless, stubborn])
def test_an_endless_step_is_given_up(loop, endless):
    loop.watch.longest = 0.2
    loop.execute(commands.Play())
    good, solver = loop.live.state, loop.live.setup.solver
    with_solver_that(loop, endless)
    loop.step()
    assert not loop.playing
    assert loop.live.state is good
    assert "given up after" in loop.notices[-1].text
    loop.live.setup = dataclasses.replace(loop.live.setup, solver=solver)
    loop.live.prepare_workspace()
    loop.step()
    assert loop.live.frame == 1


def test_a_step_is_interrupted_only_at_interruption_points(loop):
    """A setting of the process, here the number of threads, is restored also where a solver has no `try` block."""
    import numba

    before, ended = numba.get_num_threads(), []

    def changes_a_setting(state):
        numba.set_num_threads(1)
        end = time.monotonic() + 0.5
        while time.monotonic() < end:
            time.sleep(0.01)
        numba.set_num_threads(before)
        ended.append(True)
        interruption_point()
        return state, StepReport(Status.CONVERGED, 1)

    loop.watch.longest = 0.1
    with_solver_that(loop, changes_a_setting)
    loop.step()
    threads = numba.get_num_threads()
    numba.set_num_threads(before)
    assert threads == before
    assert ended
    assert "given up after" in loop.notices[-1].text


@pytest.mark.parametrize("solver", [sp.XPBD(), sp.Implicit()], ids=["xpbd", "implicit"])
def test_every_solver_can_be_interrupted(loop, solver):
    import numba

    loop.live.adopt(dataclasses.replace(loop.live.setup, solver=solver))
    state, threads = loop.live.state, numba.get_num_threads()
    loop.watch.longest = 0.0
    loop.step()
    assert "given up after" in loop.notices[-1].text
    assert loop.live.state is state
    assert numba.get_num_threads() == threads
    loop.watch.longest = 60.0
    loop.step()
    assert loop.live.frame == 1


def test_compilation_of_kernels_is_not_part_of_a_step(loop):
    """The first step of a solver on a new machine takes long, and must not be given up."""
    import numba

    def compiles(state):
        # A new kernel each time, for half a second or more in total.
        began, compiled = time.monotonic(), 0
        while time.monotonic() - began < 0.5:
            kernel = numba.njit(lambda x, y=compiled: np.sort(x)[::-1].sum() + y)
            kernel(np.zeros(3))
            compiled += 1
        return state, StepReport(Status.CONVERGED, 1)

    loop.watch.longest = 0.25
    loop.execute(commands.Play())
    with_solver_that(loop, compiles)
    loop.step()
    assert loop.notices == deque()
    assert loop.live.frame == 1
    assert loop.playing


def test_a_request_to_pause_interrupts_a_long_step(loop):
    loop.watch.longest_awaited = 0.1
    loop.execute(commands.Play())
    with_solver_that(loop, endless)
    threading.Timer(0.2, loop.inbox.put, (1, commands.Pause())).start()
    loop.step()
    assert "given up after" in loop.notices[-1].text
    loop.run_once(0.0)
    assert loop.applied == 1
    assert not loop.playing


def test_a_reset_during_a_long_step_does_not_end_play(loop):
    loop.watch.longest_awaited = 0.1
    loop.execute(commands.Play())
    loop.live.step()
    solver = loop.live.setup.solver
    with_solver_that(loop, endless)
    threading.Timer(0.2, loop.inbox.put, (1, commands.Reset())).start()
    loop.step()
    loop.live.setup = dataclasses.replace(loop.live.setup, solver=solver)
    assert loop.playing
    loop.run_once(0.0)
    assert (loop.applied, loop.playing, list(loop.notices)) == (1, True, [])
    assert loop.live.frame <= 1


def test_impossible_commands_become_notices_and_play_continues(loop):
    loop.execute(commands.Play())
    loop.execute(commands.Pin("ghost", 0))
    loop.execute(commands.SetParameter("edge_compliance", 0.1))
    assert loop.playing
    assert [notice.number for notice in loop.notices] == [1, 2]
    assert "'ghost'" in loop.notices[0].text
    for _ in range(50):
        loop.execute(commands.Pin("ghost", 0))
    assert [notice.number for notice in loop.notices] == list(range(45, 53))


def test_steps_are_simulated_without_waiting_for_the_clock(loop):
    loop.execute(commands.Step(5))
    for _ in range(7):
        loop.run_once(0.0)
    assert loop.live.frame == 5
    assert loop.steps_left == 0


def test_all_steps_count_until_a_reset(loop):
    loop.inbox.put_all(enumerate([commands.Step(), commands.Step(), commands.Step(2)], 1))
    for _ in range(6):
        loop.run_once(0.0)
    assert loop.live.frame == 4
    loop.inbox.put_all(enumerate([commands.Step(3), commands.Reset()], 4))
    for _ in range(6):
        loop.run_once(0.0)
    assert loop.live.frame == 0


def test_slow_motion_interpolates_states(loop):
    loop.execute(commands.SetSpeed(0.1))
    loop.execute(commands.Play())
    loop.step()
    loop.step()
    before, after = loop._before, loop.live.state
    due = loop.pacing.due
    half = loop.snapshot(due - 0.5 * loop._interval())
    assert half.time == pytest.approx(0.5 * (before.time + after.time))
    assert half.positions == pytest.approx(0.5 * (before.positions + after.positions))
    assert loop.snapshot(due + 1.0).time == after.time
    loop.execute(commands.Pause())
    assert loop.snapshot(due - 0.5 * loop._interval()).positions is after.positions


def test_a_snapshot_contains_what_the_view_requests(loop):
    for _ in range(20):
        loop.live.step()
    plain = loop.snapshot(0.0)
    assert plain.tet_values is None
    assert plain.contact_points is None
    loop.execute(commands.SetView("von_mises", contacts=True))
    full = loop.snapshot(0.0)
    assert full.tet_values.shape == (len(loop.live.system.tets),)
    assert full.tet_quantity == "von_mises"
    assert full.contact_points.ndim == 2


def fails(*_):
    raise RuntimeError("a mistake in the library")


def test_a_failed_view_value_becomes_a_notice_and_the_simulation_continues(loop, monkeypatch):
    loop.execute(commands.Play())
    loop.execute(commands.SetView("J", contacts=True))
    monkeypatch.setattr(simulation_loop, "contact_points", fails)
    for _ in range(3):
        loop.step()
        loop.publish(0.0)
    last = loop.outbox.snapshots[-1]
    assert [notice.text for notice in last.notices] == [
        "contacts are off: a mistake in the library; choose them again to retry"
    ]
    assert (last.frame, last.paused, last.contact_points) == (3, False, None)
    assert last.tet_values is not None
    monkeypatch.undo()
    loop.execute(commands.SetView("J", contacts=True))
    loop.publish(0.0)
    assert loop.outbox.snapshots[-1].contact_points is not None


@pytest.mark.parametrize("function", ["measures", "describe"])
def test_a_failed_snapshot_pauses_with_one_notice(loop, monkeypatch, function):
    loop.publish(0.0)
    monkeypatch.setattr(simulation_loop, function, fails)
    loop.execute(commands.Play())
    loop.step()
    loop.live.revision += 1
    for _ in range(3):
        loop.publish(0.0)
    last = loop.outbox.snapshots[-1]
    assert [notice.text for notice in last.notices] == ["paused; the page cannot be updated: a mistake in the library"]
    assert last.paused
    assert not loop.playing
    monkeypatch.undo()
    loop.execute(commands.Play())
    loop.step()
    loop.publish(0.0)
    last = loop.outbox.snapshots[-1]
    assert (last.frame, last.paused) == (2, False)
    assert loop.outbox.descriptions[-1].revision == loop.live.revision


def test_each_warning_becomes_one_notice(loop):
    log = logging.getLogger("supple.somewhere")
    with warnings_as_notices(loop.notify):
        for _ in range(3):
            log.warning("tets are too stiff for substeps of %g s", 0.002)
        log.info("not for the page")
        log.warning("something else")
    log.warning("after the end")
    assert [(one.level, one.text) for one in loop.notices] == [
        ("info", "tets are too stiff for substeps of 0.002 s"),
        ("info", "something else"),
    ]


class TestPacing:
    def paced(self, seconds_per_step, dt=1 / 60, speed=1.0, steps=120):
        pacing, now = Pacing(), 100.0
        pacing.start(now)
        for _ in range(steps):
            now = max(now, pacing.due) + seconds_per_step
            pacing.stepped(now, seconds_per_step, dt, speed)
        return pacing.timing(now, speed, True)

    def test_a_fast_simulation_runs_in_real_time(self):
        timing = self.paced(0.002)
        assert timing.real_time_ratio == pytest.approx(1.0, abs=0.03)
        assert timing.frames_per_second == pytest.approx(60.0, abs=2.0)
        assert timing.step_ms == pytest.approx(2.0)
        assert timing.keeps_up

    def test_a_slow_simulation_is_reported(self):
        timing = self.paced(0.05)
        assert timing.real_time_ratio == pytest.approx(1 / 3, abs=0.02)
        assert timing.frames_per_second == pytest.approx(20.0, abs=1.0)
        assert not timing.keeps_up

    def test_slow_motion_is_not_late(self):
        timing = self.paced(0.05, speed=0.1)
        assert timing.real_time_ratio == pytest.approx(0.1, abs=0.02)
        assert timing.keeps_up

    def test_after_a_delay_only_one_step_is_compensated(self):
        pacing = Pacing()
        pacing.start(0.0)
        pacing.stepped(0.01, 0.01, 1 / 60, 1.0)
        pacing.stepped(5.0, 4.9, 1 / 60, 1.0)
        assert pacing.due >= 5.0 - 1 / 60
