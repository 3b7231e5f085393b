"""What a run folder contains, what it refuses, and what is left where the system fails."""

import shutil
import threading

import numpy as np
import pytest

import supple as sp
from supple.app.runs.contents import RunPaths
from supple.app.runs.journal import read_journal
from supple.errors import OutputError
from supple.results.recording.recorder import Recorder
from supple.runtime import replacing
from supple.runtime.lock import is_locked

from .conftest import DT, STEPS, Drift, drifting_scene, kept, same_bits


def listing(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


def contents(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_the_files_of_a_run(out):
    kept(out, drifting_scene(), Drift(), checkpoint_every=5)
    assert listing(out) == [
        "recording.vtkhdf",
        "report.csv",
        "run/checkpoints/00000000.checkpoint",
        "run/checkpoints/00000015.checkpoint",
        "run/checkpoints/00000016.checkpoint",
        "run/run.json",
        "run/run.log",
    ]
    log = (out / "run" / "run.log").read_text(encoding="utf-8")
    for line in ("frame 0: checkpoint", "frame 10: checkpoint", "frame 16 of 16: finished"):
        assert line in log
    assert not is_locked(out)


def test_the_log_contains_the_warnings_of_its_own_thread(out):
    class Warner:
        def begin(self, first, dt, steps): ...

        def write(self, frame):
            import logging

            logging.getLogger("supple.test").warning("frame %d is late", frame.index)
            other = threading.Thread(target=logging.getLogger("supple.test").warning, args=("of another run",))
            other.start()
            other.join()

        def end(self): ...

    list(sp.simulate(drifting_scene(), Drift(), DT, 2, sinks=[sp.RunFolder(out, Drift()), Warner()]))
    log = (out / "run" / "run.log").read_text(encoding="utf-8")
    assert log.count("is late") == 2
    assert "another run" not in log


def test_a_run_is_not_touched_by_a_new_one(out):
    kept(out, drifting_scene(), Drift())
    before = contents(out)
    with pytest.raises(OutputError, match=r"contains a run; give another folder, continue it with `supple resume`"):
        sp.RunFolder(out, Drift())
    late = sp.RunFolder(out.with_name("late"), Drift())
    shutil.copytree(out, out.with_name("late"))  # after the constructor has found nothing
    with pytest.raises(OutputError, match="contains a run"):
        list(sp.simulate(drifting_scene(), Drift(), DT, 2, sinks=[late]))
    assert contents(out) == before
    assert [data for _, data in sorted(contents(out.with_name("late")).items())] == [
        data for _, data in sorted(before.items())
    ]
    assert not is_locked(out.with_name("late"))


def test_a_recording_without_a_run_is_not_touched_either(out):
    list(sp.simulate(drifting_scene(), Drift(), DT, 2, sinks=[sp.Recorder(out / "recording.vtkhdf")]))
    with pytest.raises(OutputError, match="contains a run"):
        sp.RunFolder(out, Drift())
    kept(out, drifting_scene(), Drift(), overwrite=True)
    assert len(sp.read_recording(out / "recording.vtkhdf")) == STEPS + 1


def test_overwriting_leaves_nothing_of_the_earlier_run(out):
    kept(out, drifting_scene(), Drift(), checkpoint_every=5)
    (out / "notes.txt").write_text("mine")
    kept(out, drifting_scene(2.0), Drift(), steps=3, overwrite=True, checkpoint_every=None)
    assert listing(out / "run" / "checkpoints") == ["00000000.checkpoint", "00000003.checkpoint"]
    assert len(read_journal(RunPaths(out).journal).sessions) == 1
    assert len(sp.read_recording(out / "recording.vtkhdf")) == 4
    assert (out / "notes.txt").read_text() == "mine"


def test_two_runs_into_one_folder(out):
    frames = sp.simulate(drifting_scene(), Drift(), DT, STEPS, sinks=[sp.RunFolder(out, Drift())])
    whole = [next(frames) for _ in range(3)]
    second = sp.simulate(drifting_scene(), Drift(), DT, STEPS, sinks=[sp.RunFolder(out, Drift(), overwrite=True)])
    with pytest.raises(OutputError, match=r"another run is writing to it \(process \d+\); wait for it"):
        next(second)
    with pytest.raises(OutputError, match="another run is writing to it"):
        sp.resume(out, drifting_scene(), Drift())
    whole += list(frames)
    with sp.read_recording(out / "recording.vtkhdf") as recording:
        assert all(map(same_bits, whole, list(recording)[1:]))


@pytest.mark.parametrize("value", [0, -1, 1.5, True, "10"])
def test_the_interval_of_checkpoints_is_checked(out, value):
    with pytest.raises(OutputError, match=r"checkpoint_every is .*; give a whole number of one or more, or None"):
        sp.RunFolder(out, Drift(), checkpoint_every=value)
    assert not out.exists()


def test_a_scene_that_the_solver_refuses_leaves_no_folder(out):
    with pytest.raises(sp.SuppleError, match="nothing holds it"):
        kept(out, drifting_scene(), sp.Implicit(integrator="static"))
    assert not out.exists()


def test_a_file_in_the_place_of_the_folder_is_refused(out):
    out.write_text("mine")
    with pytest.raises(OutputError, match="is not a folder"):
        sp.RunFolder(out, Drift())
    with pytest.raises(OutputError, match="is not a folder"):
        sp.RunFolder(out, Drift(), overwrite=True)
    assert out.read_text() == "mine"


def test_a_folder_that_is_removed_in_mid_run_is_an_error(out):
    frames = sp.simulate(drifting_scene(), Drift(), DT, STEPS, sinks=[sp.RunFolder(out, Drift(), checkpoint_every=2)])
    next(frames)
    shutil.rmtree(out)
    with pytest.raises(OutputError, match=r"recording\.vtkhdf: was removed or replaced while it was written"):
        next(frames)
    assert not out.exists()


def test_a_recording_that_is_replaced_in_mid_run_is_an_error(out):
    frames = sp.simulate(drifting_scene(), Drift(), DT, STEPS, sinks=[sp.RunFolder(out, Drift())])
    next(frames)
    (out / "other").write_text("mine")
    (out / "other").replace(out / "recording.vtkhdf")
    with pytest.raises(OutputError, match="was removed or replaced"):
        next(frames)
    assert (out / "recording.vtkhdf").read_text() == "mine"
    assert not is_locked(out)


def test_a_full_disk_at_a_checkpoint_keeps_the_run_resumable(out, monkeypatch):
    whole = list(sp.simulate(drifting_scene(), Drift(), DT, STEPS))
    frames = sp.simulate(drifting_scene(), Drift(), DT, STEPS, sinks=[sp.RunFolder(out, Drift(), checkpoint_every=4)])
    for _ in range(6):
        next(frames)
    fsync = replacing.os.fsync

    def full(file):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(replacing.os, "fsync", full)
    with pytest.raises(OutputError, match="cannot be written: No space left on device"):
        list(frames)
    monkeypatch.setattr(replacing.os, "fsync", fsync)
    assert not is_locked(out)
    rest = list(sp.resume(out, drifting_scene(), Drift()))
    assert rest[0].index == 5
    assert all(map(same_bits, whole[4:], rest))


@pytest.mark.parametrize("failing", range(1, 28, 5))
def test_a_full_disk_at_any_write_of_the_recording(out, monkeypatch, failing):
    """The write that fails is any of those of some frame, or of the start."""
    from supple.results.recording.file import RecordingFile

    calls, write = [], RecordingFile._write

    def full(self, place, data):
        calls.append(None)
        if len(calls) >= 5 * failing:
            write(self, place, data[: len(data) // 2])
            raise OSError(28, "No space left on device")
        write(self, place, data)

    whole = list(sp.simulate(drifting_scene(), Drift(), DT, 4))
    with monkeypatch.context() as patch:
        patch.setattr(RecordingFile, "_write", full)
        with pytest.raises(OutputError, match="cannot be written: No space left on device"):
            kept(out, drifting_scene(), Drift(), steps=4, checkpoint_every=1)
    journal = read_journal(RunPaths(out).journal)
    assert journal.sessions[-1].outcome in ("failed", "running")
    rest = list(sp.resume(out, drifting_scene(), Drift()))
    with sp.read_recording(out / "recording.vtkhdf") as recording:
        assert len(recording) == 5
        assert all(map(same_bits, whole, list(recording)[1:]))
    assert all(map(same_bits, whole[-len(rest) :], rest))


def test_ctrl_c_within_a_step_leaves_the_last_frame_as_a_checkpoint(out):
    class Interrupting(Recorder):
        def write(self, frame):
            if frame.index == 6:
                raise KeyboardInterrupt

    whole = list(sp.simulate(drifting_scene(), Drift(), DT, STEPS))
    sinks = [sp.RunFolder(out, Drift()), Interrupting(out / "x.vtkhdf")]
    with pytest.raises(KeyboardInterrupt):
        list(sp.simulate(drifting_scene(), Drift(), DT, STEPS, sinks=sinks))
    assert read_journal(RunPaths(out).journal).sessions[-1].outcome == "interrupted"
    rest = list(sp.resume(out, drifting_scene(), Drift()))
    assert all(map(same_bits, whole[6:], rest))


def test_the_clock_may_be_set_back(out, monkeypatch):
    import time

    now = time.time()
    whole = kept(out, drifting_scene(), Drift(), stop_after=5, checkpoint_every=2)
    monkeypatch.setattr(time, "time", lambda: now - 1e7)
    rest = list(sp.resume(out, drifting_scene(), Drift()))
    assert [frame.index for frame in whole + rest] == list(range(1, STEPS + 1))


def test_a_run_of_no_steps(out):
    assert kept(out, drifting_scene(), Drift(), steps=0) == []
    assert read_journal(RunPaths(out).journal).sessions[-1].outcome == "finished"
    rest = list(sp.resume(out, drifting_scene(), Drift(), steps=2))
    assert np.allclose(rest[-1].time, 2 * DT)
