"""Where the system limits the size of files, there is an error of one line and no partial file. HDF5 would crash."""

import json
import subprocess
import sys
from importlib.util import find_spec

import numpy as np
import pytest

from supple.results.export.video_worker import _write_mp4

pytest.importorskip("resource", reason="only POSIX limits the size of files")

IN_NO_ROOM = """
import json, resource, sys
from pathlib import Path
import numpy as np
import supple as sp
from supple.errors import OutputError
from supple.results.export.exporter import export
from supple.results.plots import plot_recording
from supple.results.export.video_worker import _write_mp4

ENDINGS = {"usdc": "usd"}
source, folder = Path(sys.argv[1]), Path(sys.argv[2])
mesh = sp.TetMesh(np.vstack([np.zeros(3), np.eye(3)]), [[0, 1, 2, 3]])
scene = sp.Scene([sp.Body("tet", mesh, sp.StableNeoHookean(youngs=1e4, poisson=0.3))])
box = sp.shapes.box((1, 1, 1), (4, 4, 4)).surface
noise = np.random.default_rng(0).integers(0, 255, (96, 128, 3), np.uint8)

def record(steps):
    return list(sp.simulate(scene, sp.XPBD(), 0.01, steps, sinks=[sp.Recorder(folder / "recording.vtkhdf")]))

def limit(size):
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, resource.getrlimit(resource.RLIMIT_FSIZE)[1]))

works = {
    "recording.vtkhdf": lambda: record(1000),
    "plot.png": lambda: plot_recording(source, folder / "plot.png"),
    "mesh.ele": lambda: sp.shapes.box((1, 1, 1), (12, 12, 12)).save(folder / "mesh.ele"),
    **{f"a.{to}": lambda to=to: export(source, ENDINGS.get(to, to), folder / f"a.{to}") for to in sys.argv[3:]},
    "what the mesher writes": lambda: sp.tetrahedralize(box, tets=2000),
    "video": lambda: _write_mp4(iter([np.roll(noise, k) for k in range(60)]), folder / "a.mp4", 30.0, (128, 96)),
}
little = {  # room for the first bytes only, where libraries have errors of their own
    "b.pdf": lambda: plot_recording(source, folder / "b.pdf"),
    "what the mesher reads": lambda: sp.tetrahedralize(box, tets=2000),
    **{f"b.{to}": lambda to=to: export(source, ENDINGS.get(to, to), folder / f"b.{to}") for to in sys.argv[3:]},
}
results = {}
for name, work in (works | little).items():
    limit(100 if name in little else 12_000)
    try:
        work()
        results[name] = "done"
    except (OSError, sp.SuppleError) as error:
        results[name] = str(error)
(folder / "a.mp4").unlink(missing_ok=True)  # its own writer renames it only when it is whole
limit(resource.RLIM_INFINITY)
print(json.dumps(results))
"""


def test_a_limit_of_file_sizes_is_an_error_and_leaves_no_file(tmp_path, recorded):
    formats = ["vtkhdf", "glb", *(["usdc"] if find_spec("pxr") else [])]
    command = [sys.executable, "-c", IN_NO_ROOM, str(recorded[0]), str(tmp_path), *formats]
    done = subprocess.run(command, capture_output=True, text=True, timeout=200)
    assert done.returncode == 0, done.stderr[-2000:]
    assert "Traceback" not in done.stderr
    results = json.loads(done.stdout)
    assert results.pop("video").endswith("of 60 frames; is there room?")
    files = {f"{name}.{to}" for name in "ab" for to in formats}
    meshers = {"what the mesher reads", "what the mesher writes"}
    assert set(results) == {"recording.vtkhdf", "plot.png", "b.pdf", "mesh.ele", *meshers, *files}
    for name, text in results.items():
        assert "cannot be written" in text, name
        assert "File too large" in text, name
        assert "\n" not in text
    assert list(tmp_path.iterdir()) == []


def test_where_ffmpeg_cannot_make_the_film_the_error_is_not_its_command(tmp_path):
    images = (np.full((480, 640, 3), k, np.uint8) for k in range(60))
    with pytest.raises(OSError, match="ffmpeg ended at frame"):
        _write_mp4(images, tmp_path / "absent" / "a.mp4", 30.0, (640, 480))
