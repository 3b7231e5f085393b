"""Files that take each other's place, and what is left of writers that were killed."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import supple as sp
from supple import replacing
from supple.errors import OutputError
from supple.replacing import put_in_place, remove_abandoned, temporary_name, whole_file, whole_folder

posix = pytest.mark.skipif(os.name != "posix", reason="whether a process is gone is asked the POSIX way")

DYING = """
import os, sys
from pathlib import Path
import numpy as np
import supple as sp
from supple.replacing import whole_file, whole_folder
from supple.replacing import temporary_name

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
def test_what_killed_writers_left_goes_with_the_next_file_that_is_whole(tmp_path):
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


def test_what_a_living_writer_or_another_machine_writes_is_left_alone(tmp_path, monkeypatch):
    path = tmp_path / "plot.png"
    mine = temporary_name(path)
    mine.write_text("half")
    monkeypatch.setattr(replacing, "_machine", lambda: "elsewhere")
    elsewhere = temporary_name(path)
    elsewhere.write_text("half")
    monkeypatch.undo()
    remove_abandoned(path)
    assert {p.name for p in tmp_path.iterdir()} == {mine.name, elsewhere.name}
    a_week_ago = time.time() - 7 * 86_400
    os.utime(elsewhere, (a_week_ago, a_week_ago))
    remove_abandoned(path)
    assert {p.name for p in tmp_path.iterdir()} == {mine.name}


def test_bytes_reach_the_disk_before_the_name_does(tmp_path, monkeypatch):
    told = []
    plain_sync, plain_replace = os.fsync, os.replace

    def sync(handle):
        told.append("sync")
        plain_sync(handle)

    def replace(source, target):
        told.append(f"replace {Path(target).name}")
        plain_replace(source, target)

    monkeypatch.setattr(os, "fsync", sync)
    monkeypatch.setattr(os, "replace", replace)
    fresh = tmp_path / "fresh"
    fresh.write_text("x")
    put_in_place(fresh, tmp_path / "a")
    assert told[:2] == ["sync", "replace a"]
    assert (tmp_path / "a").read_text() == "x"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes with names here")
def test_what_is_no_ordinary_file_is_not_replaced(tmp_path):
    os.mkfifo(tmp_path / "pipe.png")
    with pytest.raises(OutputError, match=r"pipe\.png: is not an ordinary file"), whole_file(tmp_path / "pipe.png"):
        pass
    assert not (tmp_path / "pipe.png").is_file()
