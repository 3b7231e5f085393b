"""`supple resume`, Ctrl-C, and `supple info` of a run folder."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import supple as sp
from supple.app.cli.app import main
from supple.app.cli.console import ExitCode
from supple.runtime.lock import FolderLock
from supple.solvers.xpbd.solver import XPBD

SCENE = """
bodies:
  - name: cube
    mesh: {file: meshes/cube.vtk}
    material: {kind: stable_neo_hookean, youngs: 1e5, poisson: 0.3}
    position: [0, 0.6, 0]
    initial: {scale: [1, 0.9, 1]}
obstacles: [{kind: half_space, name: floor}]
solver: {kind: xpbd, substeps: 5}
dt: 1/60
steps: 8
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "300")
    (tmp_path / "meshes").mkdir()
    sp.shapes.box((1, 1, 1), (2, 2, 2)).save(tmp_path / "meshes" / "cube.vtk")
    (tmp_path / "scene.yaml").write_text(SCENE)
    return tmp_path


def positions(path="out/recording.vtkhdf"):
    with sp.read_recording(path) as recording:
        return [frame.state.positions for frame in recording]


def interrupted_at(call, monkeypatch, signals=1):
    """Let XPBD's step raise signals at that call, as Ctrl-C does."""
    calls, step = [], XPBD.step

    def stepping(*arguments, **options):
        calls.append(None)
        if len(calls) == call:
            for _ in range(signals):
                signal.raise_signal(signal.SIGINT)
        return step(*arguments, **options)

    monkeypatch.setattr(XPBD, "step", stepping)


QUIET = ["-q", "--no-page", "--no-plot"]


def test_a_run_goes_on_without_its_scene_file_and_meshes(folder, capfd, monkeypatch):
    assert main(["run", "scene.yaml", *QUIET, "-o", "whole"]) == ExitCode.OK
    with monkeypatch.context() as patch:
        interrupted_at(4, patch)
        assert main(["run", "scene.yaml", *QUIET]) == ExitCode.INTERRUPTED
    err = capfd.readouterr().err
    assert err == (
        "supple: finishes the frame; Ctrl-C again stops at once\n"
        f"supple: interrupted; {os.path.join('out', 'recording.vtkhdf')} is complete to frame 4; continue with: "
        "supple resume out\n"
    )
    (folder / "scene.yaml").unlink()
    shutil.rmtree(folder / "meshes")
    (folder / "out").rename("moved")
    assert main(["resume", "moved", "-q"]) == ExitCode.OK
    assert capfd.readouterr() == ("", "")
    assert np.array_equal(positions("moved/recording.vtkhdf"), positions("whole/recording.vtkhdf"))
    assert not (folder / "moved" / "index.html").exists()


def test_a_second_ctrl_c_stops_at_once_without_harm(folder, capfd, monkeypatch):
    assert main(["run", "scene.yaml", *QUIET, "-o", "whole"]) == ExitCode.OK
    with monkeypatch.context() as patch:
        interrupted_at(4, patch, signals=2)
        assert main(["run", "scene.yaml", *QUIET]) == ExitCode.INTERRUPTED
    assert "is complete to frame 3;" in capfd.readouterr().err
    assert len(positions()) == 4
    assert main(["resume", "out", "-q"]) == ExitCode.OK
    assert np.array_equal(positions(), positions("whole/recording.vtkhdf"))


def test_ctrl_c_is_python_s_again_afterwards(folder, monkeypatch):
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    assert main(["run", "scene.yaml", *QUIET, "--steps", "1"]) == ExitCode.OK
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == before


@pytest.mark.skipif(os.name != "posix", reason="signals are sent otherwise elsewhere")
@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)])
def test_signals_of_a_process(folder, number):
    arguments = [sys.executable, "-m", "supple", "run", "scene.yaml", "--steps", "1000000", "-q"]
    # Whoever runs the tests in the background may have had SIGINT ignored; a person at a terminal has not.
    heard = lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)  # noqa: E731
    process = subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=heard)
    deadline = time.monotonic() + 120
    while not (folder / "out" / "recording.vtkhdf").exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    process.send_signal(number)
    out, err = process.communicate(timeout=120)
    assert (process.returncode, out) == (ExitCode.INTERRUPTED, "")
    assert "interrupted" in err
    assert "Traceback" not in err
    frames = len(positions())
    assert main(["resume", "out", "-q", "--steps", str(frames + 2)]) == ExitCode.OK
    assert main(["run", "scene.yaml", *QUIET, "--steps", str(frames + 2), "-o", "whole"]) == ExitCode.OK
    assert np.array_equal(positions(), positions("whole/recording.vtkhdf"))


def test_options_of_the_command_are_kept(folder, monkeypatch):
    options = ["--dt", "1/100", "--solver", "implicit", "--no-plot"]
    assert main(["run", "scene.yaml", "-q", *options, "--steps", "6", "-o", "whole"]) == ExitCode.OK
    assert main(["run", "scene.yaml", "-q", *options, "--steps", "2"]) == ExitCode.OK
    assert main(["resume", "out", "-q", "--steps", "6"]) == ExitCode.OK
    assert np.array_equal(positions(), positions("whole/recording.vtkhdf"))
    with sp.read_recording("out/recording.vtkhdf") as recording:
        assert recording.scene_text == SCENE
        assert recording.solver.startswith("Implicit(")
        assert recording.times.tolist() == pytest.approx([k / 100 for k in range(7)])
    assert (folder / "out" / "index.html").exists()
    assert not (folder / "out" / "plot.png").exists()


def test_bodies_that_were_moved_apart_stay_so(folder, capfd):
    second = SCENE.partition("bodies:\n")[2].partition("obstacles")[0].replace("name: cube", "name: second")
    text = SCENE.replace("obstacles", second.replace("[0, 0.6, 0]", "[0.1, 1.4, 0.1]") + "obstacles")
    (folder / "scene.yaml").write_text(text)
    assert main(["run", "scene.yaml", *QUIET, "--separate", "-o", "whole"]) == ExitCode.OK
    assert "moved body 'second'" in capfd.readouterr().out
    assert main(["run", "scene.yaml", *QUIET, "--separate", "--steps", "3"]) == ExitCode.OK
    assert main(["resume", "out", "-q", "--steps", "8"]) == ExitCode.OK
    assert np.array_equal(positions(), positions("whole/recording.vtkhdf"))


def test_a_demo_resumes(folder, capfd):
    arguments = ["demo", "stretch", "-q", "--no-page", "--no-plot"]
    main([*arguments, "--steps", "4", "-o", "whole"])
    main([*arguments, "--steps", "2"])
    assert main(["resume", "out/stretch", "-q", "--steps", "4"]) == ExitCode.OK
    assert np.array_equal(positions("out/stretch/recording.vtkhdf"), positions("whole/recording.vtkhdf"))
    assert main([*arguments, "--steps", "2"]) == ExitCode.INPUT
    assert "contains a run" in capfd.readouterr().err
    main([*arguments, "--steps", "3", "--overwrite"])
    assert len(positions("out/stretch/recording.vtkhdf")) == 4


@pytest.mark.parametrize(
    ("every", "kept"),
    [
        ("3", ["0", "6", "8"]),
        ("0", ["0", "8"]),
        ("1", ["0", "7", "8"]),
        ("100", ["0", "8"]),
        ("1e-9s", ["0", "7", "8"]),
    ],
)
def test_the_interval_of_checkpoints(folder, every, kept):
    assert main(["run", "scene.yaml", *QUIET, "--checkpoint-every", every]) == ExitCode.OK
    written = sorted((folder / "out" / "run" / "checkpoints").iterdir())
    assert [path.stem.lstrip("0") or "0" for path in written] == kept


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["resume", "nowhere"], "nowhere: is not a run folder"),
        (["resume", "meshes"], "meshes: is not a run folder"),
        (["resume", "scene.yaml"], "scene.yaml: is not a run folder"),
        (["run", "scene.yaml", "--checkpoint-every", "-1"], "-1 is below zero"),
        (["run", "scene.yaml", "--checkpoint-every", "1.5"], "not a whole number"),
        (["run", "scene.yaml", "--checkpoint-every", "xs"], "not a time such as 30s"),
        (["info", "meshes"], "meshes: is not a run folder"),
    ],
)
def test_what_cannot_be_done_is_one_line(folder, capfd, arguments, reason):
    assert main(arguments) == ExitCode.INPUT
    err = capfd.readouterr().err
    assert reason in err
    assert err.count("\n") == 1
    assert sorted(path.name for path in folder.iterdir()) == ["meshes", "scene.yaml"]


def test_a_changed_copy_of_a_mesh_is_refused(folder, capfd, monkeypatch):
    with monkeypatch.context() as patch:
        interrupted_at(4, patch)
        assert main(["run", "scene.yaml", *QUIET]) == ExitCode.INTERRUPTED
    capfd.readouterr()
    sp.shapes.box((1, 1, 1.001), (2, 2, 2)).save(folder / "out" / "run" / "inputs" / "0" / "cube.vtk")
    assert main(["resume", "out"]) == ExitCode.INPUT
    assert "out: the scene is not the one that was run" in capfd.readouterr().err


def info(capsys):
    assert main(["info", "out"]) == ExitCode.OK
    lines = capsys.readouterr().out.splitlines()[1:]
    return {name: value.strip() for name, _, value in (line.rstrip().partition("  ") for line in lines)}


def test_info_tells_the_story_of_a_run(folder, capsys, monkeypatch):
    with monkeypatch.context() as patch:
        interrupted_at(4, patch)
        assert main(["run", "scene.yaml", *QUIET, "--checkpoint-every", "2"]) == ExitCode.INTERRUPTED
    capsys.readouterr()
    rows = info(capsys)
    assert rows["kind"] == "run folder"
    assert rows["scene"] == "scene.yaml; as resolved: run/scene.yaml"
    assert rows["solver"].startswith("XPBD(substeps=5")
    assert rows["time"] == "8 steps of 0.0166667 s: 0.133333 s"
    assert rows["recording"].startswith("frames 0 to 4, t = 0.0666667 s; ")
    assert rows["checkpoints"] == "frames 0, 2, 4; every 2 frames or 30 s"
    assert rows["session 1"].startswith("interrupted; from frame 0 to 4; 20")
    assert rows["next"] == "supple resume out"
    assert f"numpy {np.__version__}" in rows["versions"]
    assert main(["resume", "out", "-q"]) == ExitCode.OK
    rows = info(capsys)
    assert rows["session 2"].startswith("finished; from frame 4 to 8; 20")
    assert rows["next"] == "complete; more frames: supple resume out --steps N"
    journal = json.loads((folder / "out" / "run" / "run.json").read_text())
    journal["sessions"][-1] |= {"outcome": "running", "ended": None}
    journal["sessions"][-1]["versions"]["numpy"] = "1.0"
    (folder / "out" / "run" / "run.json").write_text(json.dumps(journal))
    rows = info(capsys)
    assert rows["session 2"].startswith("killed; from frame 4; 20")
    assert rows["changed since"] == f"numpy 1.0 -> {np.__version__}"
    lock = FolderLock(folder / "out")
    rows = info(capsys)
    lock.release()
    assert rows["session 2"].startswith("running; from frame 4; 20")
    assert rows["next"] == "it is running"
