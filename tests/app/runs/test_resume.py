"""A resumed run equals the one that was never interrupted, bit by bit."""

import json
import logging
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import supple as sp
from supple.app.runs.contents import RunPaths
from supple.app.runs.journal import read_journal
from supple.errors import OutputError, SceneError
from supple.results.checkpoint.file import read_checkpoint, write_checkpoint

from .conftest import (
    DT,
    MESH,
    SOFT,
    STEPS,
    Drift,
    contact_scene,
    drifting_scene,
    kept,
    same_bits,
    stitched_scene,
)

SOLVERS = {
    "xpbd": sp.XPBD(substeps=8),
    "backward_euler": sp.Implicit(),
    "bdf2": sp.Implicit(integrator="bdf2"),
    "newmark": sp.Implicit(integrator="newmark"),
}


def rigid_scene():
    stone = sp.RigidBody("stone", sp.shapes.sphere_surface(0.1, 0.1), density=2000, angular_velocity=(1, 2, 3))
    soft = sp.Body("soft", MESH, SOFT)
    top = float(MESH.vertices[:, 1].max())
    held = sp.Pin("soft", np.flatnonzero(MESH.vertices[:, 1] == MESH.vertices[:, 1].min()))
    return sp.Scene([soft, stone.changed(position=(0, top + 0.104, 0), velocity=(0, -0.5, 0))], pins=[held])


SCENES = {"contact": contact_scene, "stitches": stitched_scene, "rigid": rigid_scene}
PAIRS = [(solver, scene) for solver in SOLVERS for scene in ("contact", "stitches")]


@cache
def whole_of(solver, scene):
    """The frames of a run that nobody interrupts."""
    return list(sp.simulate(SCENES[scene](), SOLVERS[solver], DT, STEPS))


@pytest.mark.parametrize(("solver", "scene"), [*PAIRS, ("bdf2", "rigid")])
def test_a_resumed_run_has_the_bits_of_an_uninterrupted_one(out, solver, scene):
    made, used = SCENES[scene], SOLVERS[solver]
    whole = whole_of(solver, scene)
    kept(out, made(), used, stop_after=7, checkpoint_every=3)
    rest = list(sp.resume(out, made(), used))
    assert [frame.index for frame in rest] == list(range(8, STEPS + 1))
    assert all(map(same_bits, whole[7:], rest))
    with sp.read_recording(out / "recording.vtkhdf") as recording:
        assert [frame.index for frame in recording] == list(range(STEPS + 1))
        assert all(map(same_bits, whole, list(recording)[1:]))
        for one, other in zip(whole, list(recording)[1:], strict=True):
            assert one.report.iterations == other.report.iterations
            assert one.report.min_distance == other.report.min_distance
            assert one.report.elastic_energy == other.report.elastic_energy
    assert read_journal(RunPaths(out).journal).sessions[-1].outcome == "finished"


def test_a_static_run_resumes(out):
    body = sp.Body("bar", MESH, SOFT)
    pins = [
        sp.Pin("bar", sp.InBox((-1, -1, -1), (-0.09, 1, 1))),
        sp.Pin("bar", [6, 7], lambda t: (0.3 * t, 0.1 * t, 0)),
    ]
    scene, solver = sp.Scene([body], pins=pins), sp.Implicit(integrator="static")
    whole = list(sp.simulate(scene, solver, 0.1, 6))
    frames = sp.simulate(scene, solver, 0.1, 6, sinks=[sp.RunFolder(out, solver)])
    _ = [next(frames) for _ in range(3)]
    frames.close()
    assert all(map(same_bits, whole[3:], sp.resume(out, scene, solver)))


@pytest.mark.parametrize("stop_after", [5, pytest.param(1, marks=pytest.mark.slow)])
def test_a_run_may_be_resumed_many_times(out, stop_after):
    solver, whole = SOLVERS["bdf2"], whole_of("bdf2", "contact")
    frames = kept(out, contact_scene(), solver, stop_after)
    while len(frames) < STEPS:
        rest = sp.resume(out, contact_scene(), solver)
        frames += [frame for _, frame in zip(range(stop_after), rest, strict=False)]
        rest.close()
    assert all(map(same_bits, whole, frames))


def test_frames_after_the_last_checkpoint_are_computed_again_and_stay(out, caplog):
    """As after a kill: the recording is ahead of the last checkpoint."""
    solver = SOLVERS["xpbd"]
    whole = kept(out, contact_scene(), solver, stop_after=9, checkpoint_every=4)
    paths = RunPaths(out)
    paths.checkpoint(9).unlink()
    with sp.read_recording(paths.recording) as recording:
        seconds = recording.series("wall_seconds")
    rest = list(sp.resume(out, contact_scene(), solver))
    assert rest[0].index == 9
    assert same_bits(rest[0], whole[8])
    with sp.read_recording(paths.recording) as recording:
        assert len(recording) == STEPS + 1
        assert np.array_equal(recording.series("wall_seconds")[:10], seconds)  # the frames that were there
    assert caplog.records == []


def test_frames_that_are_computed_differently_are_replaced_from_there(out, caplog):
    """As where another version computes other bits: here another solver pretends to be that of the run."""
    kept(out, drifting_scene(), Drift(), stop_after=9, checkpoint_every=4)
    paths, other = RunPaths(out), Drift(stops_at=9, status=sp.Status.ITERATION_LIMIT)
    checkpoint = read_checkpoint(paths.checkpoint(8))
    paths.checkpoint(9).unlink()
    write_checkpoint(paths.checkpoint(8), replace(checkpoint, run=replace(checkpoint.run, solver=str(other))))
    rest = list(sp.resume(out, drifting_scene(), other))
    assert rest[0].report.status == "iteration_limit"
    told = [record.getMessage() for record in caplog.records if record.name.startswith("supple.results")]
    assert told == [f"{paths.recording}: frame 9 differs from the recorded one; replacing it and later ones"]
    with sp.read_recording(out / "recording.vtkhdf") as recording:
        assert recording.statuses[9] == "iteration_limit"
        assert len(recording) == STEPS + 1


def test_a_complete_run_is_refused_until_it_shall_have_more_frames(out):
    solver, whole = SOLVERS["newmark"], whole_of("newmark", "contact")
    kept(out, contact_scene(), solver, steps=6)
    with pytest.raises(OutputError, match=r"6 of 6 frames are there; give a larger number of steps"):
        sp.resume(out, contact_scene(), solver)
    rest = list(sp.resume(out, contact_scene(), solver, steps=STEPS))
    assert all(map(same_bits, whole[6:], rest))
    assert read_journal(RunPaths(out).journal).run.steps == STEPS
    with pytest.raises(OutputError, match=f"{STEPS} of {STEPS} frames are there"):
        sp.resume(out, contact_scene(), solver)


def test_a_compressed_recording_goes_on(out):
    kept(out, drifting_scene(), Drift(), stop_after=5, compress=True)
    list(sp.resume(out, drifting_scene(), Drift()))
    with sp.read_recording(out / "recording.vtkhdf") as recording:
        assert len(recording) == STEPS + 1
        assert recording._file.dataset("VTKHDF/Points").compression == "gzip"


def test_a_run_that_begins_with_a_recorded_frame_resumes(out, tmp_path):
    """The pins hold their vertices where the recorded frame has them."""
    solver = SOLVERS["bdf2"]
    list(sp.simulate(stitched_scene(), solver, DT, 4, sinks=[sp.Recorder(tmp_path / "first.vtkhdf")]))
    with sp.read_recording(tmp_path / "first.vtkhdf") as recording:
        frame = recording[-1]
        scene = stitched_scene()
        whole = list(sp.simulate(scene, solver, DT, 8, start=frame))
        frames = sp.simulate(scene, solver, DT, 8, start=frame, sinks=[sp.RunFolder(out, solver)])
        assert [next(frames).index for _ in range(3)] == [5, 6, 7]
        frames.close()
    rest = list(sp.resume(out, stitched_scene(), solver))
    assert [frame.index for frame in rest] == [8, 9, 10, 11, 12]
    assert all(map(same_bits, whole[3:], rest))


def test_initial_positions_need_not_be_given_again(out):
    start = {"cube": 1.1 * drifting_scene().bodies[0].mesh.vertices}
    whole = list(sp.simulate(drifting_scene(), Drift(), DT, STEPS, initial_positions=start))
    sinks = [sp.RunFolder(out, Drift())]
    frames = sp.simulate(drifting_scene(), Drift(), DT, STEPS, initial_positions=start, sinks=sinks)
    next(frames)
    frames.close()
    assert all(map(same_bits, whole[1:], sp.resume(out, drifting_scene(), Drift())))


def test_a_solver_that_stopped_stops_again_at_the_same_frame(out):
    solver = Drift(stops_at=6)
    seen = kept(out, drifting_scene(), solver, checkpoint_every=4)
    assert seen[-1].report.status == "not_finite"
    journal = read_journal(RunPaths(out).journal)
    assert journal.sessions[-1].outcome == "stopped"
    assert journal.sessions[-1].message == "not_finite: vertex 2 left for infinity"
    assert [path.name for path in RunPaths(out).checkpoints()] == [
        "00000005.checkpoint",
        "00000004.checkpoint",
        "00000000.checkpoint",
    ]
    (again,) = sp.resume(out, drifting_scene(), solver)
    assert (again.index, again.report.status) == (6, "not_finite")
    with sp.read_recording(out / "recording.vtkhdf") as recording:
        assert len(recording) == 7


@pytest.mark.parametrize(
    ("scene", "solver", "steps", "error", "text"),
    [
        (drifting_scene(2.0), Drift(), None, SceneError, "the scene is not the one that was run"),
        (contact_scene(), Drift(), None, SceneError, "the scene is not the one that was run"),
        (drifting_scene(), Drift(stops_at=3), None, OutputError, r"was run with Drift\(stops_at=-1"),
        (drifting_scene(), None, None, OutputError, "the scene is given without its solver"),
        (None, None, None, OutputError, "the scene of this run is not a file; give scene and solver"),
        (drifting_scene(), Drift(), 5, OutputError, "5 of 5 frames are there"),
        (drifting_scene(), Drift(), 7.5, OutputError, "give a larger number of steps"),
    ],
)
def test_another_run_is_refused_and_nothing_is_written(out, scene, solver, steps, error, text):
    kept(out, drifting_scene(), Drift(), stop_after=5)
    before = {path: path.stat().st_mtime_ns for path in out.rglob("*")}
    with pytest.raises(error, match=text) as caught:
        sp.resume(out, scene, solver, steps=steps)
    assert str(caught.value).startswith(str(out))
    assert {path: path.stat().st_mtime_ns for path in out.rglob("*")} == before


def test_a_folder_without_a_run_is_refused(tmp_path):
    with pytest.raises(OutputError, match=r"is not a run folder: it has no run/run\.json"):
        sp.resume(tmp_path)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "is damaged"),
        ("[]", "is damaged"),
        ("{}", "is damaged"),
        ('{"format": 1}', "is damaged"),
        ('{"format": 2}', "another version; simulate it again"),
        ("[" * 100_000, "is damaged"),
        ("\0\xff", "is damaged"),
    ],
)
def test_a_damaged_journal_is_one_line(out, text, reason):
    kept(out, drifting_scene(), Drift(), stop_after=2)
    RunPaths(out).journal.write_text(text, encoding="latin-1")
    with pytest.raises(OutputError, match=reason):
        sp.resume(out, drifting_scene(), Drift())


def test_a_damaged_checkpoint_is_passed_over(out, caplog):
    whole = list(sp.simulate(drifting_scene(), Drift(), DT, STEPS))
    kept(out, drifting_scene(), Drift(), stop_after=9, checkpoint_every=4)
    paths = RunPaths(out)
    data = bytearray(paths.checkpoint(9).read_bytes())
    data[-1] ^= 1
    paths.checkpoint(9).write_bytes(data)
    rest = list(sp.resume(out, drifting_scene(), Drift()))
    assert rest[0].index == 9  # from the checkpoint of frame 8
    assert all(map(same_bits, whole[8:], rest))
    assert [record.getMessage() for record in caplog.records] == [
        f"{paths.checkpoint(9)}: is damaged: its checksum is wrong; delete it, so that an earlier checkpoint is used"
    ]
    assert not paths.checkpoint(9).exists()


def test_without_any_whole_checkpoint_the_run_is_refused(out):
    kept(out, drifting_scene(), Drift(), stop_after=9, checkpoint_every=4)
    for path in RunPaths(out).checkpoints():
        path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(OutputError, match="has no whole checkpoint"):
        sp.resume(out, drifting_scene(), Drift())


def test_a_run_that_was_killed_before_its_recording_begins_again(out):
    whole = kept(out, drifting_scene(), Drift(), stop_after=3)
    RunPaths(out).recording.unlink()
    rest = list(sp.resume(out, drifting_scene(), Drift()))
    assert all(map(same_bits, whole, rest))
    with sp.read_recording(out / "recording.vtkhdf") as recording:
        assert len(recording) == STEPS + 1


def test_a_checkpoint_later_than_the_recording_is_passed_over(out, caplog):
    """As after a failure of the power that lost the last frames of the recording."""
    kept(out, drifting_scene(), Drift(), stop_after=5, checkpoint_every=2)
    paths = RunPaths(out)
    recorded = paths.recording.read_bytes()
    list(sp.resume(out, drifting_scene(), Drift()))
    paths.recording.write_bytes(recorded)
    rest = list(sp.resume(out, drifting_scene(), Drift()))
    assert rest[0].index == 1  # from the first checkpoint: the others were of frames 14 and 16
    assert [record.getMessage().partition(": ")[2] for record in caplog.records] == ["is later than the recording"] * 2
    with sp.read_recording(paths.recording) as recording:
        assert len(recording) == STEPS + 1


def test_a_recording_of_another_run_is_refused(out, tmp_path):
    kept(out, drifting_scene(), Drift(), stop_after=5)
    kept(tmp_path / "other", drifting_scene(3.0), Drift(), stop_after=5)
    before = (tmp_path / "other" / "recording.vtkhdf").read_bytes()
    (out / "recording.vtkhdf").write_bytes(before)
    with pytest.raises(OutputError, match="its frame 5 is not the one to continue from"):
        list(sp.resume(out, drifting_scene(), Drift()))
    assert (out / "recording.vtkhdf").read_bytes() == before


def test_other_versions_are_a_warning(out, caplog):
    kept(out, drifting_scene(), Drift(), stop_after=5)
    path = RunPaths(out).checkpoint(5)
    checkpoint = read_checkpoint(path)
    write_checkpoint(path, replace(checkpoint, versions={**checkpoint.versions, "numpy": "1.0"}))
    with caplog.at_level(logging.WARNING):
        list(sp.resume(out, drifting_scene(), Drift()))
    assert f"{out}: the last bits may differ, since versions did: numpy 1.0 -> {np.__version__}" in caplog.text


def test_the_journal_lists_the_sessions(out):
    kept(out, drifting_scene(), Drift(), stop_after=5, seed=42)
    list(sp.resume(out, drifting_scene(), Drift()))
    data = json.loads(RunPaths(out).journal.read_text(encoding="utf-8"))
    assert data["seed"] == 42
    assert data["origin"] == {"kind": "python"}
    assert (data["run"]["steps"], data["run"]["dt"], data["run"]["solver"]) == (STEPS, DT, str(Drift()))
    first, second = data["sessions"]
    assert (first["first_frame"], first["last_frame"], first["outcome"]) == (0, 5, "interrupted")
    assert (second["first_frame"], second["last_frame"], second["outcome"]) == (5, STEPS, "finished")
    for session in (first, second):
        assert session["versions"]["numpy"] == np.__version__
        assert session["machine"]["threads"] >= 1
        assert session["begun"] <= session["ended"]
