"""Replacing files as a whole, and deleting what killed writers left."""

import itertools
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import supple as sp
from supple.errors import OutputError
from supple.runtime import replacing
from supple.runtime.replacing import (
    put_in_place,
    remove_abandoned,
    temporary_name,
    whole_file,
    whole_files,
    whole_folder,
)

posix = pytest.mark.skipif(os.name != "posix", reason="needs POSIX to know whether a process exists")

DYING = """
import os, sys
from pathlib import Path
import numpy as np
import supple as sp
from supple.runtime.replacing import temporary_name, whole_file, whole_folder

folder = Path(sys.argv[1])
with whole_file(folder / "plot.png") as fresh, whole_folder(folder / "a_obj") as inside:
    fresh.write_text("half")
    (inside / "1.obj").write_text("half")
    temporary_name(folder / "recording.vtkhdf").write_text("half")
    temporary_name(folder / "ball.stl").write_text("half")
    temporary_name(folder / "a.1.ele").write_text("half")
    os._exit(9)
"""


@posix
def test_the_next_writer_deletes_what_killed_writers_left(tmp_path):
    for _ in range(2):
        assert subprocess.run([sys.executable, "-c", DYING, str(tmp_path)], timeout=100).returncode == 9
    assert all(path.name.startswith(".") for path in tmp_path.iterdir())
    assert len(list(tmp_path.iterdir())) == 10
    foreign = tmp_path / ".plot.mine.png"
    foreign.write_text("not a temporary file")

    with whole_file(tmp_path / "plot.png") as fresh:
        fresh.write_text("whole")
    with whole_folder(tmp_path / "a_obj") as inside:
        (inside / "1.obj").write_text("whole")
    mesh = sp.TetMesh(np.vstack([np.zeros(3), np.eye(3)]), [[0, 1, 2, 3]])
    mesh.surface.save(tmp_path / "ball.stl")
    mesh.save(tmp_path / "a.1.ele")
    scene = sp.Scene([sp.Body("tet", mesh, sp.StableNeoHookean(youngs=1e4, poisson=0.3))])
    list(sp.simulate(scene, sp.XPBD(), 0.01, 1, sinks=[sp.Recorder(tmp_path / "recording.vtkhdf")]))

    names = {path.name for path in tmp_path.iterdir()}
    tetgen = {f"a.1.{kind}" for kind in ("node", "ele", "edge", "face")}
    assert names == {"plot.png", "a_obj", "ball.stl", "recording.vtkhdf", foreign.name} | tetgen


def test_files_of_running_writers_and_of_other_machines_stay(tmp_path, monkeypatch):
    path = tmp_path / "plot.png"
    own = temporary_name(path)
    own.write_text("half")
    monkeypatch.setattr(replacing, "_machine", lambda: "elsewhere")
    elsewhere = temporary_name(path)
    elsewhere.write_text("half")
    monkeypatch.undo()
    remove_abandoned(path)
    assert {p.name for p in tmp_path.iterdir()} == {own.name, elsewhere.name}
    a_week_ago = time.time() - 7 * 86_400
    os.utime(elsewhere, (a_week_ago, a_week_ago))
    remove_abandoned(path)
    assert {p.name for p in tmp_path.iterdir()} == {own.name}


def test_the_bytes_are_on_the_disk_before_the_name_changes(tmp_path, monkeypatch):
    calls = []
    plain_sync, plain_replace = os.fsync, os.replace

    def sync(handle):
        calls.append("sync")
        plain_sync(handle)

    def replace(source, target):
        calls.append(f"replace {Path(target).name}")
        plain_replace(source, target)

    monkeypatch.setattr(os, "fsync", sync)
    monkeypatch.setattr(os, "replace", replace)
    fresh = tmp_path / "fresh"
    fresh.write_text("x")
    put_in_place(fresh, tmp_path / "a")
    assert calls[:2] == ["sync", "replace a"]
    assert (tmp_path / "a").read_text() == "x"


def _write(fresh):
    for path in fresh.values():
        path.write_text("new")


def _write_and_fail(fresh):
    _write(fresh)
    raise ZeroDivisionError


@pytest.mark.parametrize("failure", [KeyboardInterrupt(), OSError(28, "No space left on device")])
@pytest.mark.parametrize("at", range(1, 6))
def test_a_group_is_replaced_together_or_not_at_all(tmp_path, monkeypatch, failure, at):
    """Fail at each of the renames: two files that move aside, three that move in."""
    paths = [tmp_path / name for name in ("a.node", "a.ele", "a.face")]
    for path in paths[:2]:
        path.write_text("old")
    plain, count = os.replace, itertools.count(1)

    def replace(source, target):
        if next(count) == at:
            raise failure
        plain(source, target)

    monkeypatch.setattr(os, "replace", replace)
    expected = KeyboardInterrupt if isinstance(failure, KeyboardInterrupt) else sp.MeshError
    with pytest.raises(expected), whole_files(*paths, error=sp.MeshError) as fresh:
        _write(fresh)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a.node": "old", "a.ele": "old"}


def test_a_failed_block_leaves_the_old_files(tmp_path):
    (tmp_path / "a").write_text("old")
    with pytest.raises(ZeroDivisionError), whole_files(tmp_path / "a", tmp_path / "b") as fresh:
        _write_and_fail(fresh)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a": "old"}


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes with names here")
def test_a_pipe_is_not_replaced(tmp_path):
    os.mkfifo(tmp_path / "pipe.png")
    with pytest.raises(OutputError, match=r"pipe\.png: is not an ordinary file"), whole_file(tmp_path / "pipe.png"):
        pass
    assert not (tmp_path / "pipe.png").is_file()
