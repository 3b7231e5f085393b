"""Recordings of writers that are killed, and on full disks: what is there can be read, and errors are one line."""

import errno
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from supple.errors import OutputError
from supple.model.state import Status
from supple.results.export.exporter import export
from supple.results.recording import file as recording_file
from supple.results.recording.file import RecordingFile
from supple.results.recording.reader import read_recording

_CONFTEST = Path(__file__).with_name("conftest.py")


_RECORDS_WITHOUT_END = """
import os, random, runpy, sys, time
from pathlib import Path
import supple as sp
import supple.results.recording.recorder as module
from supple.results.recording.reader import read_recording
from supple.simulate import simulate

tools = runpy.run_path(sys.argv[1])
folder, children = Path(sys.argv[2]), int(sys.argv[3])
module._FIRST_FRAMES = 4
# The energy of this material is measured without threads, which would not survive a fork.
scene = tools["small_scene"](material=sp.EdgesAndVolume(density=1000.0))
solver = tools["Prescribed"]()

def record_without_end(path):
    for frame in simulate(scene, solver, 1 / 30, 1_000_000, sinks=[module.Recorder(path)]):
        pass

# All modules and kernels are loaded before the first fork.
list(simulate(scene, solver, 1 / 30, 6, sinks=[module.Recorder(folder / "first.vtkhdf")]))
chance = random.Random(7)
for attempt in range(children):
    path = folder / f"killed-{attempt}.vtkhdf"
    child = os.fork()
    if child == 0:
        record_without_end(path)
        os._exit(1)
    wanted = (0, 1, 2, 4, 5, 8, 12)[attempt % 7]
    while wanted and not (path.exists() and len(read_recording(path)) >= wanted):
        time.sleep(0.0002)
    time.sleep(chance.uniform(0.0, 0.01))
    os.kill(child, 9)
    os.waitpid(child, 0)
"""


def _kill(tmp_path: Path, children: int) -> list[Path]:
    """Recordings of child processes that were killed at random times."""
    command = [sys.executable, "-c", _RECORDS_WITHOUT_END, str(_CONFTEST), str(tmp_path), str(children)]
    one_thread = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
    subprocess.run(command, check=True, timeout=120, env=os.environ | one_thread)
    return sorted(tmp_path.glob("killed-*.vtkhdf"))


@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks many children, which must start quickly")
def test_the_recording_of_a_killed_writer_holds_every_complete_frame(tmp_path, tools, recorded):
    """Writers are killed while they write frames, and while they copy the file to a larger one."""
    vtk, to_numpy = tools.vtk()
    rest = recorded[1][0].system.rest_positions[:27]
    counts = []
    for path in _kill(tmp_path, 10):
        with read_recording(path) as recording:
            counts.append(len(recording))
            for frame in (recording[0], recording[-1], recording[len(recording) // 2]):
                stretch = 1.0 + 0.3 * np.sin(4.0 * frame.time)
                np.testing.assert_allclose(
                    frame.positions["cube"], (rest + np.array([0, 1, 0])) * (1, stretch, 1), atol=1e-9
                )
                np.testing.assert_allclose(frame.det_F, stretch, atol=1e-9)
                assert frame.report.status == Status.CONVERGED
            np.testing.assert_allclose(recording.times, np.arange(len(recording)) / 30, atol=1e-9)
            last = recording[-1].state.positions
        # What `supple export --to vtkhdf` repairs, VTK reads with all frames.
        copy = export(path, "vtkhdf", path.with_name(f"repaired-{path.name}"))
        reader = vtk.vtkHDFReader()
        reader.SetFileName(str(copy))
        reader.UpdateInformation()
        assert reader.GetNumberOfSteps() == counts[-1]
        reader.SetStep(counts[-1] - 1)
        reader.Update()
        np.testing.assert_array_equal(to_numpy(reader.GetOutput().GetPoints().GetData()), last)
    assert len(counts) > 7
    assert max(counts) > 8  # some files were copied to larger ones twice


def test_the_file_is_valid_before_every_single_write(tmp_path, tools, monkeypatch):
    """Before each single write to the file, its contents are valid for us, and VTK can read the first frame."""
    path = tmp_path / "cut.vtkhdf"
    vtk, _ = tools.vtk()
    seen, plain = set(), RecordingFile._write

    def look_before_writing(self, place, data):
        if self.path == path:
            with read_recording(path) as recording:
                frame = recording[-1]
                np.testing.assert_allclose(frame.det_F, 1.0 + 0.3 * np.sin(4.0 * frame.time), atol=1e-9)
                seen.add(len(recording))
            reader = vtk.vtkHDFReader()
            reader.SetFileName(str(path))
            reader.UpdateInformation()
            assert reader.GetNumberOfSteps() == 1
            reader.Update()
            assert reader.GetOutput().GetNumberOfPoints() == 54
        plain(self, place, data)

    monkeypatch.setattr(RecordingFile, "_write", look_before_writing)
    tools.record(path, 2)
    assert seen == {1, 2}
    assert len(read_recording(path)) == 3


def test_a_full_disk_is_an_error_and_earlier_frames_stay(tmp_path, tools, monkeypatch):
    path = tmp_path / "full.vtkhdf"
    plain = RecordingFile._write

    def no_room(self, place, data):
        if self.written == 4 and place != self._counter:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        plain(self, place, data)

    monkeypatch.setattr(RecordingFile, "_write", no_room)
    with pytest.raises(OutputError, match=r"full\.vtkhdf: cannot be written: No space left"):
        tools.record(path, 10)
    with read_recording(path) as recording:
        assert len(recording) == 4


def test_no_room_at_the_start_leaves_nothing(tmp_path, tools, monkeypatch):
    def no_room(self, place, data):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(RecordingFile, "_write", no_room)
    with pytest.raises(OutputError, match="No space left"):
        tools.record(tmp_path / "full.vtkhdf", 10)
    assert list(tmp_path.iterdir()) == []


class FullDisk:
    """A disk with room for `room` bytes in `folder`."""

    def __init__(self, folder, room):
        self.folder, self.room = folder, room

    def __call__(self, path):
        used = sum(file.stat().st_blocks * 512 for file in self.folder.iterdir())
        return SimpleNamespace(free=max(0, self.room - used))


@pytest.mark.parametrize("room", [0, 1 << 12, 1 << 16])
def test_too_little_room_for_the_scene_is_an_error(tmp_path, tools, monkeypatch, room):
    monkeypatch.setattr(recording_file.shutil, "disk_usage", FullDisk(tmp_path, room))
    with pytest.raises(OutputError, match=r"full\.vtkhdf: cannot be written: No space left"):
        tools.record(tmp_path / "full.vtkhdf", 10)
    assert list(tmp_path.iterdir()) == []


def test_too_little_room_for_a_copy_is_an_error(tmp_path, monkeypatch, recorded):
    with read_recording(recorded[0]) as recording:
        monkeypatch.setattr(recording_file.shutil, "disk_usage", FullDisk(tmp_path, 80_000))
        with pytest.raises(OutputError, match=r"small\.vtkhdf: cannot be written: No space left"):
            export(recording, "vtkhdf", tmp_path / "small.vtkhdf")
    assert list(tmp_path.iterdir()) == []
