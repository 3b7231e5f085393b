"""Studies on real worker processes: results, resumption, failures, and workers that are killed."""

import csv
import os
import signal
from pathlib import Path

import numpy as np
import pytest

import supple as sp
from supple.app.studies.measures import Measure, Measures

from .conftest import FALL_DT, FALL_STEPS, SCENE, fallen, make_fall

DROP = Measures({"drop": Measure("displacement", "cube", axis="y")})
SETTINGS = {"solver": sp.XPBD(substeps=1, contact=None), "dt": FALL_DT, "steps": FALL_STEPS}


def drop(recording):
    return recording[-1].positions["cube"][:, 1].mean() - recording[0].positions["cube"][:, 1].mean()


@pytest.fixture
def scene_file(tmp_path):
    path = tmp_path / "fall.yaml"
    path.write_text(SCENE, encoding="utf-8")
    return path


def result_times(folder):
    return {path.parent.name: path.stat().st_mtime_ns for path in folder.glob("cases/*/recording.vtkhdf")}


def test_pool_and_cluster_give_the_same_table_as_the_formula(cluster, scene_file, tmp_path):
    factors = {"gravity.1": [-10.0, -5.0, 1.0], "solver.substeps": [1, 2]}
    tables = []
    for name, where in (("pool", {"workers": 2}), ("grid", {"scheduler": cluster})):
        tables.append(sp.sweep(scene_file, factors, measure=DROP, units=DROP.units, folder=tmp_path / name, **where))
    pool, grid = ((tmp_path / name / "table.csv").read_bytes() for name in ("pool", "grid"))
    assert pool == grid
    header, *rows = csv.reader(pool.decode().splitlines())
    assert header == ["case", "gravity.1 [m/s^2]", "solver.substeps", "drop [m]", "status", "reason"]
    assert [row[1:3] for row in rows] == [[g, n] for g in ("-10.0", "-5.0", "1.0") for n in ("1", "2")]
    for table in tables:
        expected = [fallen(-g, n) for g in (-10.0, -5.0, 1.0) for n in (1, 2)]
        np.testing.assert_allclose(table["drop"], expected, rtol=1e-9)
        assert table.done.all()
    for row in rows:
        folder = tmp_path / "pool" / "cases" / row[0]
        assert {path.name for path in folder.iterdir()} == {"scene.yaml", "recording.vtkhdf", "result.json"}
        again = list(sp.simulate(sp.load_run(folder / "scene.yaml").scene, **SETTINGS))  # a complete scene file
        assert again[-1].index == FALL_STEPS


@pytest.mark.slow
def test_each_worker_has_its_share_of_the_cores(cluster, tmp_path):
    def threads(recording):
        import numba

        return {"numba": numba.get_num_threads(), "omp": int(os.environ["OMP_NUM_THREADS"])}

    cores = os.cpu_count() or 1
    shared = sp.sweep(
        make_fall_here(), {"gravity": [1.0]}, measure=threads, folder=tmp_path / "a", workers=1, **SETTINGS
    )
    assert (shared["numba"][0], shared["omp"][0]) == (cores, cores)
    # Nothing is known of the machines of a cluster: one thread, unless the worker's environment gives more.
    alone = sp.sweep(
        make_fall_here(), {"gravity": [1.0]}, measure=threads, folder=tmp_path / "b", scheduler=cluster, **SETTINGS
    )
    if "NUMBA_NUM_THREADS" not in os.environ:
        assert alone["numba"][0] == 1


def make_fall_here():
    """`make_fall` as a local function: workers cannot import this test's module, and get its code instead."""

    def make(gravity, height=2.0):
        cube = sp.Body("cube", sp.shapes.box((1, 1, 1), (1, 1, 1)), sp.EdgesAndVolume(), position=(0, height, 0))
        return sp.Scene([cube], gravity=(0, -gravity, 0))

    return make


def test_cases_that_have_ended_are_not_simulated_again(cluster, scene_file, tmp_path):
    def study(values, measure=DROP, **options):
        return sp.sweep(
            scene_file, {"gravity.1": values}, measure=measure, folder=tmp_path / "s", scheduler=cluster, **options
        )

    study([-1.0, -2.0])
    first = result_times(tmp_path / "s")
    table = study([-1.0, -2.0, -3.0])
    second = result_times(tmp_path / "s")
    assert len(first) == 2
    assert len(second) == 3
    assert {key: second[key] for key in first} == first
    np.testing.assert_allclose(table["drop"], [fallen(g) for g in (1.0, 2.0, 3.0)], rtol=1e-9)
    # Another measure is taken from the recordings.
    other = study(
        [-1.0, -2.0, -3.0], Measures({"top": Measure("position", "cube", axis="y", over="max", time="first")})
    )
    assert result_times(tmp_path / "s") == second
    np.testing.assert_allclose(other["top"], 2.5)
    # A scene file that has changed is another study.
    scene_file.write_text(SCENE.replace("steps: 10", "steps: 5"), encoding="utf-8")
    study([-1.0])
    assert len(result_times(tmp_path / "s")) == 4


def test_a_failed_case_is_recorded_with_its_reason_and_is_never_fatal(cluster, tmp_path):
    def make(kind):
        if kind == "error":
            raise sp.SceneError("this scene is impossible")
        if kind == "bug":
            return {}["absent"]
        if kind == "wrong":
            return 3
        if kind == "exit":
            raise SystemExit("enough")
        youngs = 1e300 if kind == "stiff" else 1e4
        mesh = sp.shapes.box((1, 1, 1), (1, 1, 1))
        cube = sp.Body("cube", mesh, sp.StableNeoHookean(youngs=youngs, poisson=0.3), velocity=(0, 1e200, 0))
        return sp.Scene([cube] if kind == "stiff" else [sp.Body("cube", mesh, sp.EdgesAndVolume())])

    def measure(recording):
        return {"y": recording[-1].positions["cube"][:, 1].mean(), "n": len(recording)}

    kinds = ["fine", "error", "bug", "wrong", "stiff", "exit"]
    progress = []
    options = {"measure": measure, "folder": tmp_path / "s", "scheduler": cluster, **SETTINGS}
    table = sp.sweep(make, {"kind": kinds}, progress=progress.append, **options)
    assert table.done.tolist() == [True] + [False] * 5
    assert table.reasons[0] == ""
    assert table.reasons[1] == "this scene is impossible"
    assert table.reasons[2] == "KeyError: 'absent'"
    assert table.reasons[3] == "make returned a int; return a Scene, or a Run with its own solver"
    assert table.reasons[4].startswith("frame 1: ")
    assert table.reasons[5] == "SystemExit: enough"
    assert np.isnan(table["y"][1:]).all()
    assert (progress[-1].done, progress[-1].failed, progress[-1].cases) == (1, 5, 6)
    assert progress[-1].seconds_left == 0.0
    trace = (tmp_path / "s" / "cases" / table.keys[2] / "log.txt").read_text(encoding="utf-8")
    assert "Traceback" in trace
    with (tmp_path / "s" / "table.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["status"] for row in rows] == ["done"] + ["failed"] * 5
    assert [row["reason"] for row in rows] == list(table.reasons)
    # Failed cases stay as they are, unless they are to be tried again.
    logs = tmp_path / "s" / "cases" / table.keys[2] / "log.txt"
    before = logs.stat().st_mtime_ns
    sp.sweep(make, {"kind": kinds}, **options)
    assert logs.stat().st_mtime_ns == before
    sp.sweep(make, {"kind": kinds}, retry_failed=True, **options)
    assert logs.stat().st_mtime_ns > before


def test_a_measure_that_fails_is_taken_again_without_a_simulation(cluster, scene_file, tmp_path):
    def study(measure):
        return sp.sweep(scene_file, {"steps": [3]}, measure=measure, folder=tmp_path / "s", scheduler=cluster)

    def infinite(recording):
        return float("inf")

    def frames(recording):
        return len(recording)

    table = study(infinite)
    assert table.reasons == ("the measure 'measure' is inf; it must be finite",)
    first = result_times(tmp_path / "s")
    table = study(frames)
    assert table["measure"].tolist() == [4.0]
    assert table.reasons == ("",)
    assert result_times(tmp_path / "s") == first
    assert study(lambda recording: "many").reasons[0].startswith("the measure 'measure' is 'many'; return a number")


def killing(marks: Path, victims: str):
    """A function whose case 3 kills its worker: the first time, or each time."""

    def make(case):
        import os

        import supple as sp

        mark = marks / f"case-{case}"
        with mark.open("a") as file:
            file.write("x")
        if case == 3 and (victims == "always" or mark.stat().st_size == 1):
            os.kill(os.getpid(), signal.SIGKILL)
        cube = sp.Body("cube", sp.shapes.box((1, 1, 1), (1, 1, 1)), sp.EdgesAndVolume())
        return sp.Scene([cube], gravity=(0, -1.0 * case, 0))

    return make


@pytest.mark.skipif(os.name != "posix", reason="kills processes by signals")
def test_a_killed_process_loses_no_case(tmp_path):
    marks = tmp_path / "marks"
    marks.mkdir()
    cases = [2, 3, 4]
    make = killing(marks, "once")
    table = sp.sweep(make, {"case": cases}, measure=DROP, folder=tmp_path / "s", workers=1, **SETTINGS)
    assert table.done.all(), table.reasons
    np.testing.assert_allclose(table["drop"], [fallen(g) for g in cases], rtol=1e-9)
    assert (marks / "case-3").stat().st_size >= 2


def killing_in_mid_run(marks: Path):
    """A function whose solver marks each step, and kills its worker at the seventh step of case 2, the first time."""

    def make(case):
        import os
        from dataclasses import dataclass

        import supple as sp

        mark = marks / f"case-{case}"

        @dataclass(frozen=True)
        class Marking(sp.XPBD):
            def step(self, system, state, dt, workspace):
                with mark.open("a") as file:
                    file.write("x")
                if case == 2 and mark.stat().st_size == 7:
                    os.kill(os.getpid(), signal.SIGKILL)
                return super().step(system, state, dt, workspace)

        cube = sp.Body("cube", sp.shapes.box((1, 1, 1), (1, 1, 1)), sp.EdgesAndVolume())
        solver = Marking(substeps=1, contact=None)
        return sp.Run(sp.Scene([cube], gravity=(0, -1.0 * case, 0)), solver, FALL_DT, FALL_STEPS)

    return make


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="kills processes by signals")
def test_a_killed_worker_loses_no_case_and_its_own_goes_on_from_the_checkpoint(tmp_path):
    marks = tmp_path / "marks"
    marks.mkdir()
    make = killing_in_mid_run(marks)
    cases = [1, 2, 3, 4]
    table = sp.sweep(make, {"case": cases}, measure=DROP, folder=tmp_path / "s", workers=2, checkpoint_seconds=0)
    assert table.done.all(), table.reasons
    np.testing.assert_allclose(table["drop"], [fallen(g) for g in cases], rtol=1e-9)
    steps = [(marks / f"case-{case}").stat().st_size for case in cases]
    assert sum(steps) <= 4 * FALL_STEPS + 2, "what was recorded is not simulated again"
    assert steps[1] == FALL_STEPS + 1, "only the step in which the worker was killed is taken again"
    for folder in (tmp_path / "s" / "cases").iterdir():
        assert {path.name for path in folder.iterdir()} == {"recording.vtkhdf", "result.json"}
        with sp.read_recording(folder / "recording.vtkhdf") as recording:
            assert [frame.index for frame in recording] == list(range(FALL_STEPS + 1))


def simulate_in(run, folder, seconds):
    from supple.app.runs.recorded import simulate_recorded

    return simulate_recorded(run, folder / "recording.vtkhdf", folder / "checkpoint", seconds)


def begun_case(folder, seconds=0.0):
    """A case that was interrupted after its sixth frame, as a killed worker leaves it; the whole case beside it."""
    from supple.app.runs import recorded as module

    run = sp.Run(make_fall(10.0), SETTINGS["solver"], FALL_DT, FALL_STEPS)
    whole, half = folder / "whole", folder / "half"
    for path in (whole, half):
        path.mkdir(parents=True)
    simulate_in(run, whole, seconds)

    class Killed(BaseException):
        pass

    def killed(self, frame):
        write(self, frame)
        if frame.index == 6:
            raise Killed

    write = module.CheckpointSink.write
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module.CheckpointSink, "write", killed)
        with pytest.raises(Killed):
            simulate_in(run, half, seconds)
    return run, whole, half


@pytest.mark.parametrize("fault", ["none", "damaged", "another case", "no recording"])
def test_a_begun_case_has_the_bits_of_an_uninterrupted_one_or_begins_again(tmp_path, caplog, fault):
    run, whole, half = begun_case(tmp_path)
    checkpoint = half / "checkpoint"
    if fault == "damaged":
        checkpoint.write_bytes(checkpoint.read_bytes()[:-1])
    if fault == "another case":
        run = sp.Run(make_fall(5.0), run.solver, run.dt, run.steps)
        simulate_in(run, whole, 30.0)
    if fault == "no recording":
        (half / "recording.vtkhdf").unlink()
    assert simulate_in(run, half, 0.0) == (FALL_STEPS, "")
    assert not checkpoint.exists()
    with sp.read_recording(whole / "recording.vtkhdf") as one, sp.read_recording(half / "recording.vtkhdf") as two:
        assert len(one) == len(two) == FALL_STEPS + 1
        for first, second in zip(one, two, strict=True):
            assert np.array_equal(first.state.positions, second.state.positions)
    assert ("begins again" in caplog.text) == (fault == "another case")
    assert ("is damaged" in caplog.text) == (fault == "damaged")


def test_a_short_case_has_no_checkpoint(tmp_path):
    _, _, half = begun_case(tmp_path, seconds=30.0)
    assert not (half / "checkpoint").exists()


def test_two_studies_in_one_folder_are_refused(tmp_path):
    from supple.runtime.lock import FolderLock

    folder = tmp_path / "s"
    folder.mkdir()
    held = FolderLock(folder)
    with pytest.raises(sp.OutputError, match=rf"another run is writing to it \(process {os.getpid()}\)"):
        sp.sweep(make_fall, {"gravity": [1.0]}, measure=DROP, folder=folder, workers=1, **SETTINGS)
    assert [path.name for path in folder.iterdir()] == [".supple.lock"]
    held.release()


def test_a_case_that_another_worker_is_busy_with_is_lost_and_not_damaged(tmp_path):
    from supple.app.studies.run_case import Measuring, run_case
    from supple.app.studies.sources import varied_function
    from supple.runtime.lock import FolderLock

    job = varied_function(make_fall, SETTINGS["solver"], FALL_DT, FALL_STEPS)({"gravity": 1.0}).job
    held = FolderLock(tmp_path)
    result = run_case(job, tmp_path, Measuring(DROP, "", 30.0))
    assert (result.status, result.lost) == ("failed", True)
    assert "another run is writing to it" in result.reason
    assert [path.name for path in tmp_path.iterdir()] == [".supple.lock"]
    held.release()
    assert run_case(job, tmp_path, Measuring(DROP, "", 30.0)).status == "done"
    with pytest.raises(sp.StudyError, match="checkpoint_seconds is -1; give a number of zero or more"):
        sp.sweep(make_fall, {"gravity": [1.0]}, measure=DROP, folder=tmp_path, checkpoint_seconds=-1, **SETTINGS)


@pytest.mark.skipif(os.name != "posix", reason="kills processes by signals")
def test_a_case_that_always_kills_its_worker_fails_and_the_others_do_not(cluster, tmp_path):
    marks = tmp_path / "marks"
    marks.mkdir()
    cases = [1, 2, 3, 4]
    make = killing(marks, "always")
    options = {"measure": DROP, "folder": tmp_path / "s", "scheduler": cluster, **SETTINGS}
    table = sp.sweep(make, {"case": cases}, **options)
    assert table.done.tolist() == [True, True, False, True]
    assert table.reasons[2].startswith("2 workers were lost")
    tried = (marks / "case-3").stat().st_size
    sp.sweep(make, {"case": cases}, **options)  # lost workers are worth another try
    assert (marks / "case-3").stat().st_size > tried


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"factors": {"gravity.7": [1]}}, "gravity.7: gravity has no entry '7'"),
        ({"factors": {"gravitty": [1]}}, "no case of the study is allowed; .*fall.yaml:1: gravitty: unknown key"),
        ({"factors": {"steps": [-1, -2]}}, "no case of the study is allowed; .*steps: is -1"),
        ({"factors": {}}, "no factors"),
        ({"factors": {"steps": 3}}, "factor 'steps' is 3"),
        ({"measure": 3}, "measure is 3"),
        ({"workers": 0}, "workers is 0"),
        ({"scheduler": "tcp://127.0.0.1:1"}, "the scheduler tcp://127.0.0.1:1 cannot be reached"),
    ],
)
def test_a_study_that_cannot_be_carried_out_is_refused_in_one_line(scene_file, tmp_path, monkeypatch, arguments, words):
    monkeypatch.setattr("supple.app.studies.executors._CONNECT_SECONDS", 1)
    given = {"factors": {"steps": [1]}, "measure": DROP, "folder": tmp_path / "s"} | arguments
    with pytest.raises(sp.SuppleError, match=words):
        sp.sweep(scene_file, **given)
    assert "scheduler" in arguments or not (tmp_path / "s").exists()


def test_some_values_that_are_not_allowed_are_failed_cases(cluster, scene_file, tmp_path):
    table = sp.sweep(scene_file, {"steps": [1, -1]}, measure=DROP, folder=tmp_path / "s", scheduler=cluster)
    assert table.done.tolist() == [True, False]
    assert "steps: is -1; it must be at least 0" in table.reasons[1]


def test_a_function_that_does_not_take_the_factors_is_refused():
    with pytest.raises(sp.StudyError, match="make_fall cannot be called with speed"):
        sp.sweep(make_fall, {"speed": [1]}, measure=drop)
