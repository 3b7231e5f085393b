"""What costs nothing while nobody watches or nothing happens, progress of long steps, and readings."""

import time

import numpy as np
import pytest

import supple as sp
from supple.app.viewer.engine import simulation_loop
from supple.app.viewer.engine.describe import readings, strongest_forces
from supple.app.viewer.engine.scene.live_scene import LiveScene
from supple.app.viewer.engine.step_watch import StepWatch
from supple.app.viewer.protocol import commands
from supple.app.viewer.protocol.live_source import LiveSource
from supple.errors import CommandError
from supple.runtime.interruption import interruption_point


def test_time_runs_only_while_somebody_watches(loop):
    loop.execute(commands.Play())
    loop.run_once(0.0)
    assert loop.live.frame == 1
    loop.execute(commands.Watch(False))
    loop.pacing.due = 0.0
    loop.run_once(0.0)
    assert loop.live.frame == 1
    assert loop._time_to_wait() > 0.3
    loop.execute(commands.Step())  # asked for
    loop.run_once(0.0)
    assert loop.live.frame == 2
    loop.execute(commands.Play())
    loop.execute(commands.Watch(True))
    loop.run_once(0.0)
    assert loop.live.frame == 3
    with pytest.raises(CommandError, match="give true or false"):
        commands.Watch(1)


def test_a_paused_simulation_sends_heartbeats_and_no_snapshots(loop, monkeypatch):
    monkeypatch.setattr(simulation_loop, "HEARTBEAT", 0.0)
    loop.execute(commands.Pause())
    loop.publish(time.perf_counter())
    sent = len(loop.outbox.snapshots)
    monkeypatch.setattr(loop, "snapshot", lambda now: pytest.fail("a snapshot of what has not changed"))
    for _ in range(3):
        loop.run_once(0.0)
    assert len(loop.outbox.snapshots) == sent
    assert loop.outbox.progress == [None] * 3


def test_the_progress_of_a_step():
    watch = StepWatch(10.0)
    assert watch.progress is None
    with watch.limited():
        for _ in range(3):
            interruption_point()
        progress = watch.progress
        assert (progress.rounds, progress.kernels) == (3, None)
        assert 0.0 <= progress.seconds < 5.0
    assert watch.progress is None


def test_the_first_colors_are_reported_as_a_long_step(loop, monkeypatch):
    """Their kernels are compiled outside of a step, for seconds."""
    found = []

    def values(*_):
        found.append(loop.watch.progress)
        return np.zeros(1)

    monkeypatch.setattr(simulation_loop, "tet_values", values)
    loop.execute(commands.SetView("von_mises"))
    loop.publish(0.0)
    assert [progress is not None for progress in found] == [True]
    assert loop.watch.progress is None


def test_forces_of_contacts_and_what_a_sensor_reads():
    """A block at rest on a floor: the forces add up to its weight, and the sensor below it feels them."""
    rubber = sp.StableNeoHookean(youngs=1e5, poisson=0.4, density=1000.0, damping=0.05)
    block = sp.Body("block", sp.shapes.box((0.4, 0.4, 0.4), (3, 3, 3)), rubber, position=(0.0, 0.2, 0.0))
    sensor = sp.ForceSensor("sole", "block", sp.InBox((-1.0, -1.0, -1.0), (1.0, 0.01, 1.0)))
    scene = sp.Scene([block], obstacles=[sp.HalfSpace()], sensors=[sensor])
    live = LiveScene(LiveSource("rest", scene, sp.XPBD(substeps=8), 1 / 60))
    assert strongest_forces(live) is None
    for _ in range(60):
        live.step()
    weight = 9.81 * 1000.0 * 0.4**3
    points, forces = strongest_forces(live)
    np.testing.assert_allclose(forces.sum(axis=0), [0.0, weight, 0.0], atol=0.02 * weight)
    assert np.abs(points[:, 1]).max() < 0.01
    assert (np.diff(np.linalg.norm(forces, axis=1)) <= 0.0).all()
    [reading] = readings(live)
    assert (reading.name, reading.unit) == ("sole", "N")
    assert reading.value == pytest.approx(weight, rel=0.02)
