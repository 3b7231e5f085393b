"""The simulation process: the page cannot block it, and it ends with the page."""

import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import textwrap
import threading
import time

import numpy as np
import pytest

import supple as sp
from supple.app.viewer.engine.engine import Engine
from supple.app.viewer.protocol.commands import (
    MoveGrab,
    Pause,
    Play,
    Reset,
    SetParameter,
    SetSpeed,
    SetView,
    Step,
)
from supple.app.viewer.protocol.live_source import LiveSource
from supple.app.viewer.protocol.outbox import DESCRIPTION, SNAPSHOT, Outbox
from supple.errors import CommandError, SceneError, SolverError

from .conftest import free_source, small_source

TIMEOUT = 60.0


@pytest.fixture(scope="module")
def engine():
    with Engine(small_source()) as engine:
        yield engine


@pytest.fixture
def fresh(engine):
    """The shared engine, paused at the start of the scene that it began with."""
    engine.send(Pause())
    engine.send(SetView())
    engine.send(SetSpeed(1.0))
    engine.wait_for(engine.send(Reset()), TIMEOUT)
    return engine


def until(engine, condition, what):
    end = time.monotonic() + TIMEOUT
    while time.monotonic() < end:
        snapshot = engine.latest()
        if condition(snapshot):
            return snapshot
        time.sleep(0.01)
    pytest.fail(f"did not happen: {what}; {engine.error}")


def test_it_starts_paused_with_a_description(fresh):
    snapshot = fresh.latest()
    assert snapshot.paused
    assert snapshot.frame == 0
    description = snapshot.description
    assert [body.name for body in description.bodies] == ["cube", "block"]
    assert len(snapshot.positions) == 64 + 45
    assert description.n_tets == 27 * 6 + 16 * 6
    assert [(one.name, type(one).__name__) for one in description.obstacles] == [("floor", "HalfSpace")]
    assert len(snapshot.pinned) == 9


def test_it_computes_the_same_as_simulate(fresh):
    source = small_source()
    *_, last = sp.simulate(source.scene, source.solver, source.dt, 12)
    fresh.wait_for(fresh.send(Step(12)), TIMEOUT)
    snapshot = until(fresh, lambda s: s.frame == 12, "12 steps")
    assert np.array_equal(snapshot.positions, last.state.positions)
    assert snapshot.measures.elastic_energy == last.report.elastic_energy
    assert snapshot.time == last.time


def test_play_runs_and_pause_stops(fresh):
    fresh.send(Play())
    until(fresh, lambda s: s.frame >= 5, "5 frames")
    paused = fresh.wait_for(fresh.send(Pause()), TIMEOUT)
    assert paused.paused
    time.sleep(0.2)
    assert fresh.latest().frame == paused.frame


class Gated:
    """The reading end of a pipe that is not read until the gate is open."""

    def __init__(self, pipe):
        self.pipe, self.gate, self.waiting = pipe, threading.Event(), threading.Event()

    def recv_bytes(self):
        self.waiting.set()
        self.gate.wait()
        return self.pipe.recv_bytes()


def test_a_page_that_does_not_read_does_not_block_the_simulation(fresh):
    # A snapshot has about 3 KiB, a pipe holds 64 KiB: a simulation that waits for its reader would stop after about
    # twenty frames, and never skip one.
    pipe = fresh._snapshots
    fresh._snapshots = gated = Gated(pipe)
    try:
        fresh.send(Play())
        assert gated.waiting.wait(TIMEOUT)
        time.sleep(2.0)
        stale = fresh.latest().frame
        gated.gate.set()
        until(fresh, lambda s: s.frame > stale + 40, "frames that were simulated without a reader")
    finally:
        gated.gate.set()
        fresh._snapshots = pipe


def test_an_outbox_keeps_only_the_newest_snapshot_and_never_blocks():
    reader, writer = multiprocessing.Pipe(duplex=False)
    outbox = Outbox(writer)
    outbox.put_description("old")
    for k in range(100):
        outbox.put_snapshot((k, bytes(100_000)))
    outbox.put_description("new")
    outbox.put_snapshot((100, b""))
    received = []
    while not received or received[-1] != (SNAPSHOT, (100, b"")):
        data = reader.recv_bytes()
        received.append((data[:1], pickle.loads(data[1:])))
    assert len(received) < 20
    # What comes after the new description belongs to it.
    assert received[-2:] == [(DESCRIPTION, "new"), (SNAPSHOT, (100, b""))]


def test_ten_thousand_moves_at_once_are_merged(fresh):
    began = fresh.latest().applied
    for k in range(10_000):
        assert fresh.send(MoveGrab(3, (0.0, 0.001 * k, 0.0)))
    number = fresh.send(SetParameter("youngs", 2e5, "cube"))
    assert number == began + 10_001
    snapshot = fresh.wait_for(number, TIMEOUT)
    assert snapshot.description.body("cube").values["youngs"] == 2e5
    fresh.send(SetParameter("youngs", 1e5, "cube"))


def test_only_commands_can_be_sent(fresh):
    with pytest.raises(CommandError, match="str is not a command"):
        fresh.send("__import__('os').system('true')")


def test_the_constructor_refuses_a_scene_that_cannot_be_simulated():
    source = small_source()
    springs = sp.Body("springs", sp.shapes.box(), sp.EdgesAndVolume())
    with pytest.raises(SolverError, match="'springs'"):
        Engine(LiveSource("springs", sp.Scene([springs]), sp.Implicit(), source.dt))


def test_local_functions_and_classes_of_the_program_are_sent():
    source = small_source()
    speed = 0.1
    floor = sp.HalfSpace(motion=lambda t: (0.0, speed * t, 0.0), name="floor")
    scene = sp.Scene(source.scene.bodies, [floor])
    *_, last = sp.simulate(scene, source.solver, source.dt, 3)
    with Engine(LiveSource("lift", scene, source.solver, source.dt)) as engine:
        engine.wait_for(engine.send(Step(3)), TIMEOUT)
        assert np.array_equal(until(engine, lambda s: s.frame == 3, "3 steps").positions, last.state.positions)


def test_a_function_that_holds_what_another_process_cannot_have():
    lock = threading.Lock()
    scene = sp.Scene(small_source().scene.bodies, [sp.HalfSpace(motion=lambda t: (0.0, float(lock.locked()), 0.0))])
    with pytest.raises(SceneError, match=r"cannot be sent to another process \(.*lock.*\); use Keyframes, Curve"):
        Engine(LiveSource("lift", scene, small_source().solver, 0.01))


def test_a_killed_process_is_reported_and_nothing_blocks(fresh):
    os.kill(fresh._process.pid, signal.SIGKILL)
    end = time.monotonic() + TIMEOUT
    while fresh.alive and time.monotonic() < end:
        time.sleep(0.01)
    assert fresh.send(Play()) == 0
    while fresh.error is None and time.monotonic() < end:
        time.sleep(0.01)
    assert "unexpectedly" in fresh.error
    assert fresh.latest() is not None
    with pytest.raises(TimeoutError, match="unexpectedly"):
        fresh.wait_for(10**9, TIMEOUT)
    # It is started again from its source.
    fresh.restart()
    assert fresh.error is None
    first = fresh.latest()
    assert (first.frame, first.paused) == (0, True)
    number = fresh.send(Step(2))
    assert until(fresh, lambda s: s.frame == 2, "2 steps").applied == number


def test_a_source_is_read_again_and_what_runs_goes_on_where_that_fails():
    first, second = small_source(), free_source()
    with Engine(first, again=lambda: second) as engine:
        engine.send(Step(2))
        number = engine.send(SetParameter("youngs", 2e5))
        engine.wait_for(number, TIMEOUT)
        engine.reload()
        assert engine.starts == 2
        assert [body.name for body in engine.description.bodies] == [body.name for body in second.scene.bodies]
        assert engine.latest().frame == 0
        assert engine.latest().applied == number, "no input of the page waits for a command of the first one"
        engine.wait_for(engine.send(Step(1)), TIMEOUT)

        def broken():
            raise SceneError("scene.yaml:3: wrong")

        engine.again = broken
        with pytest.raises(SceneError, match="wrong"):
            engine.reload()
        assert engine.alive
        engine.wait_for(engine.send(Step(1)), TIMEOUT)


@pytest.mark.skipif(os.name != "posix", reason="sends a signal")
def test_the_simulation_process_ignores_ctrl_c(fresh):
    """The signal reaches both processes."""
    fresh.send(Play())
    before = until(fresh, lambda s: s.frame >= 2, "2 frames")
    os.kill(fresh._process.pid, signal.SIGINT)
    until(fresh, lambda s: s.frame >= before.frame + 5, "5 frames more")
    assert fresh.latest().notices == before.notices


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="looks at /proc")
def test_it_ends_when_the_process_of_the_page_is_killed(tmp_path):
    script = tmp_path / "page.py"
    script.write_text(
        textwrap.dedent("""
        import time
        import supple as sp
        from supple.app.viewer.engine.engine import Engine
        from supple.app.viewer.protocol.live_source import LiveSource
        from supple.app.viewer.protocol.commands import Play

        if __name__ == "__main__":
            body = sp.Body("cube", sp.shapes.box((1, 1, 1), (2, 2, 2)), sp.StableNeoHookean(youngs=1e5, poisson=0.3))
            engine = Engine(LiveSource("cube", sp.Scene([body]), sp.XPBD(substeps=2), 0.01))
            engine.send(Play())
            print(engine._process.pid, flush=True)
            time.sleep(600)
        """)
    )
    page = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True)
    child = int(page.stdout.readline())
    page.kill()
    page.wait()
    end = time.monotonic() + TIMEOUT
    while _runs(child) and time.monotonic() < end:
        time.sleep(0.02)
    assert not _runs(child)


def _runs(pid):
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().rsplit(")", 1)[1].split()[0] not in "ZX"
    except OSError:
        return False
