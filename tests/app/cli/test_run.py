"""`supple run`: outputs and exit codes."""

import os

import numpy as np
import pytest

import supple as sp
from supple.app.cli.app import main
from supple.app.cli.console import ExitCode
from supple.results.recording.reader import read_recording
from supple.solvers.xpbd.solver import XPBD

SCENE = """
bodies:
  - name: cube
    shape: {kind: box, divisions: [2, 2, 2]}
    material: {kind: stable_neo_hookean, youngs: 1e5, poisson: 0.3}
    position: [0, 0.6, 0]
obstacles: [{kind: half_space, name: floor}]
solver: {kind: xpbd, substeps: 5}
dt: 1/60
steps: 6
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.yaml").write_text(SCENE)
    return tmp_path


ALWAYS = ["recording.vtkhdf", "report.csv", "run"]


def listing(folder):
    return sorted(path.name for path in folder.iterdir())


def test_writes_recording_page_and_plot_and_prints_their_paths(folder, capfd):
    assert main(["run", "scene.yaml", "-o", "out/first"]) == ExitCode.OK
    products = ["index.html", "plot.png", "recording.vtkhdf"]
    assert listing(folder / "out" / "first") == sorted({*products, *ALWAYS})
    out, err = capfd.readouterr()
    for name in products:
        assert os.path.join("out", "first", name) in out
    assert "6 frames to t = 0.1 s (converged)" in out
    assert out.startswith("scene      1 body, 48 tets, 6 frames of 0.0166667 s\nsolver     XPBD(substeps=5")
    assert "supple:" not in err
    with read_recording(folder / "out" / "first" / "recording.vtkhdf") as recording:
        assert len(recording) == 7
        assert recording.scene_text == SCENE
        assert "XPBD(substeps=5" in recording.solver
        x = recording[-1].positions["cube"]
    run = sp.load_run("scene.yaml")
    *_, last = sp.simulate(run.scene, run.solver, run.dt, run.steps)
    assert np.array_equal(x, last.positions["cube"])


def test_quiet_without_page_and_plot(folder, capfd):
    arguments = ["run", "scene.yaml", "--no-page", "--no-plot", "--quiet", "--steps", "2", "--dt", "0.25"]
    assert main([*arguments, "--solver", "xpbd"]) == ExitCode.OK
    assert capfd.readouterr() == ("", "")
    assert listing(folder / "out") == ALWAYS
    with read_recording("out/recording.vtkhdf") as recording:
        assert recording.times.tolist() == [0.0, 0.25, 0.5]
        assert "XPBD(substeps='auto'" in recording.solver


def test_options_override_page_and_plot_of_the_file(folder):
    (folder / "scene.yaml").write_text(SCENE + "output: {page: false, plot: false, compress: true}\n")
    assert main(["run", "scene.yaml", "-q", "--steps", "1", "--plot"]) == ExitCode.OK
    assert listing(folder / "out") == ["plot.png", *ALWAYS]


def test_a_second_run_into_a_folder_is_refused_unless_it_overwrites(folder, capfd):
    arguments = ["run", "scene.yaml", "-q", "--no-page", "--no-plot", "--steps"]
    assert main([*arguments, "3"]) == ExitCode.OK
    before = {path: path.read_bytes() for path in (folder / "out").rglob("*") if path.is_file()}
    assert main([*arguments, "2"]) == ExitCode.INPUT
    err = capfd.readouterr().err
    assert "out: contains a run; give another folder, continue it with `supple resume`, or replace it" in err
    assert err.count("\n") == 1
    assert {path: path.read_bytes() for path in (folder / "out").rglob("*") if path.is_file()} == before
    assert main([*arguments, "2", "--overwrite"]) == ExitCode.OK
    with read_recording("out/recording.vtkhdf") as recording:
        assert len(recording) == 3
    assert listing(folder / "out" / "run" / "checkpoints") == ["00000000.checkpoint", "00000002.checkpoint"]


def test_a_page_of_an_earlier_run_is_a_warning(folder, caplog):
    (folder / "out").mkdir()
    (folder / "out" / "index.html").write_text("older")
    assert main(["run", "scene.yaml", "-q", "--no-page", "--no-plot", "--steps", "1"]) == ExitCode.OK
    assert [record.getMessage() for record in caplog.records] == [
        f"{os.path.join('out', 'index.html')} shows an earlier run"
    ]
    assert (folder / "out" / "index.html").read_text() == "older"


def test_a_deformed_start_is_where_the_recording_begins(folder):
    (folder / "scene.yaml").write_text(SCENE.replace("    position", "    initial: {scale: [1, 0.5, 1]}\n    position"))
    assert main(["run", "scene.yaml", "-q", "--no-page", "--no-plot", "--steps", "1"]) == ExitCode.OK
    with read_recording("out/recording.vtkhdf") as recording:
        assert np.ptp(recording[0].positions["cube"], axis=0) == pytest.approx([1, 0.5, 1])


@pytest.mark.filterwarnings("error::RuntimeWarning")  # such numbers must not overflow on the way to the message
def test_a_solver_that_cannot_go_on_is_exit_3_with_the_recording_up_to_there(folder, caplog):
    (folder / "scene.yaml").write_text(SCENE + "gravity: [0, -1.0e+290, 0]\n")
    assert main(["run", "scene.yaml", "-q", "--no-page", "--no-plot", "--dt", "1e20"]) == ExitCode.SOLVER
    text = caplog.messages[-1]
    assert text.startswith("stopped at frame 1 of 6, t = 0 s: not_finite: XPBD: body 'cube', vertex ")
    assert text.endswith("take more substeps or a shorter dt")
    with read_recording("out/recording.vtkhdf") as recording:
        assert len(recording) == 2
        assert np.isfinite(recording[-1].positions["cube"]).all()
        assert recording.statuses[-1] == "not_finite"


def fails_at(call, error, step):
    """`step`, raising `error` at that call."""
    calls = []

    def failing(*arguments, **options):
        calls.append(None)
        if len(calls) == call:
            raise error
        return step(*arguments, **options)

    return failing


def test_ctrl_c_keeps_the_frames_before_it(folder, capfd, monkeypatch):
    monkeypatch.setattr(XPBD, "step", fails_at(4, KeyboardInterrupt(), XPBD.step))
    assert main(["run", "scene.yaml", "-q"]) == ExitCode.INTERRUPTED
    err = capfd.readouterr().err
    assert "interrupted" in err
    assert err.count("\n") == 1
    with read_recording("out/recording.vtkhdf") as recording:
        assert len(recording) == 4
    assert listing(folder / "out") == ALWAYS


@pytest.mark.parametrize(
    ("option", "text", "reason"),
    [
        ("--steps", "1.5", "not a whole number"),
        ("--steps", "1e3", "not a whole number"),
        ("--steps", "many", "not a whole number"),
        ("--steps", "-1", "zero or more"),
        ("--dt", "1/0", "neither a number nor a fraction"),
        ("--dt", "1/2/3", "neither a number nor a fraction"),
        ("--dt", "1 s", "neither a number nor a fraction"),
        ("--dt", "-0.5", "above zero"),
        ("--dt", "inf", "finite"),
        ("--dt", "1e300", "between"),
        ("--dt", "5e-324", "between"),
    ],
)
def test_numbers_are_parsed_strictly(folder, capfd, option, text, reason):
    assert main(["run", "scene.yaml", "-q", option, text]) == ExitCode.INPUT
    err = capfd.readouterr().err
    assert reason in err
    assert err.count("\n") == 1
    assert listing(folder) == ["scene.yaml"]


def test_dt_may_be_a_fraction(folder):
    assert main(["run", "scene.yaml", "-q", "--no-page", "--no-plot", "--steps", "2", "--dt", "1/30"]) == ExitCode.OK
    with read_recording("out/recording.vtkhdf") as recording:
        assert recording.times.tolist() == [0.0, 1 / 30, 2 / 30]


def test_strict_fails_where_a_frame_did_not_converge(folder, capfd):
    text = (folder / "scene.yaml").read_text()
    assert "substeps: 5" in text
    stiff = text.replace("substeps: 5", "substeps: 5, accuracy: 1e-9")
    (folder / "scene.yaml").write_text(stiff)
    command = ["run", "scene.yaml", "--no-page", "--no-plot", "--quiet"]
    assert main(command) == ExitCode.OK
    command += ["--overwrite"]
    assert main([*command, "--strict"]) == ExitCode.FAILED
    with read_recording("out/recording.vtkhdf") as recording:
        assert {str(status) for status in recording.statuses[1:]} == {"softened"}
        assert "too soft" in recording[-1].report.message
    (folder / "scene.yaml").write_text(text.replace("substeps: 5", "substeps: 5, accuracy: 0.9"))
    assert main([*command, "--strict"]) == ExitCode.OK
