"""What remains of a mesher whose program was killed."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from supple.errors import MeshingError
from supple.mesh.io.in_child import PREFIX
from supple.mesh.meshing.child_process import A_DAY
from supple.mesh.meshing.tetrahedralize import tetrahedralize
from supple.mesh.primitives.surfaces import sphere_surface
from supple.mesh.surface import SurfaceMesh

LINUX = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="/proc, and a child that ends with its parent")


def children(pid):
    return [int(text) for text in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def is_running(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


def until(condition, seconds=30.0):
    end = time.monotonic() + seconds
    while not (found := condition()) and time.monotonic() < end:
        time.sleep(0.05)
    return found


@LINUX
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_the_mesher_ends_with_its_program(number, tmp_path):
    """A request to end also cleans up; what a kill leaves is deleted after a day."""
    sphere_surface(radius=0.5, edge_length=0.1).save(tmp_path / "ball.stl")
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    # Work for longer than the test; fewer tets than those that are warned of.
    command = [sys.executable, "-m", "supple", "mesh", "ball.stl", "--max-volume", "2e-6", "-o", "ball.vtu"]
    parent = subprocess.Popen(command, cwd=tmp_path, env=os.environ | {"TMPDIR": str(scratch)}, stderr=subprocess.PIPE)
    mesher = until(lambda: children(parent.pid))[0]
    assert until(lambda: "tetgen" in Path(f"/proc/{mesher}/maps").read_text())
    parent.send_signal(number)
    _, output = parent.communicate(timeout=30)
    assert until(lambda: not is_running(mesher))
    assert not (tmp_path / "ball.vtu").exists()
    if number == signal.SIGTERM:
        assert parent.returncode == 130
        assert output.endswith(b"supple: interrupted\n")
        assert list(scratch.iterdir()) == []


def test_folders_left_behind_are_deleted_after_a_day(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    old, young, other = tmp_path / f"{PREFIX}old", tmp_path / f"{PREFIX}young", tmp_path / "other"
    for folder in (old, young, other):
        folder.mkdir()
        (folder / "surface.npz").write_bytes(b"")
    for folder in (old, other):
        os.utime(folder, times=(time.time() - 2.0 * A_DAY,) * 2)
    tetrahedralize(sphere_surface(radius=0.5, edge_length=0.3))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["other", f"{PREFIX}young"]


@pytest.mark.parametrize("scale", [1e-300, 1e-100])
def test_a_surface_too_small_for_its_volume_to_be_a_number_is_refused(scale):
    ball = sphere_surface(radius=0.5, edge_length=0.3)
    small = SurfaceMesh(np.multiply(scale, ball.vertices), ball.triangles)
    with pytest.raises(MeshingError, match=r"the surface is \S+ m long; one below 1e-60 m cannot be meshed: scale it"):
        tetrahedralize(small)
