"""What fails in mid-run: numbers that are not finite, linear systems, the disk. The last good state stays there."""

import logging
import subprocess

import numpy as np
import pytest

import supple as sp
from supple.app.runs.contents import RunPaths
from supple.app.runs.journal import read_journal
from supple.errors import OutputError, SceneError, SuppleError
from supple.model.state import State
from supple.numerics.sparse.pcg import CGResult
from supple.results.checkpoint.file import read_checkpoint
from supple.runtime.lock import is_locked
from supple.solvers.implicit.energies.elasticity import Elasticity
from supple.solvers.implicit.newton import linear_solver
from supple.solvers.xpbd.frame.substep import SubstepRunner

from .conftest import DT, Drift, circling, drifting_scene, kept, same_bits, stitched_scene

MESH = sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1))
SOFT = sp.StableNeoHookean(youngs=2e4, poisson=0.3, density=1000)
SOLVERS = pytest.mark.parametrize("solver", [sp.XPBD(substeps=4), sp.Implicit()], ids=["xpbd", "implicit"])


def last_state(folder):
    """The state of the latest checkpoint."""
    return read_checkpoint(RunPaths(folder).checkpoints()[0]).state


class Sensor:
    """A function of time that returns NaN once it is broken, as one does that reads from outside."""

    def __init__(self, scale=0.0):
        self.broken, self.scale = False, scale

    def __call__(self, time):
        return (np.nan, 0.0, 0.0) if self.broken else (self.scale * np.sin(9 * time), 0.0, 0.0)


def sensed_scene(acts_on, sensor):
    """A cube, held or pushed by a sensor."""
    body = sp.Body("cube", MESH, SOFT)
    top = sp.InBox((-1, 0.049, -1), (1, 1, 1))
    held = sp.Pin("cube", top, sensor if acts_on == "pin" else None)
    forces = [sp.Force("cube", [0], sensor)] if acts_on == "force" else []
    targets = [sp.SoftTarget("cube", [0], 10.0, sensor)] if acts_on == "soft target" else []
    return sp.Scene([body], pins=[held], forces=forces, soft_targets=targets)


@SOLVERS
@pytest.mark.parametrize("acts_on", ["pin", "force", "soft target"])
def test_a_script_that_returns_nan_in_mid_run(out, solver, acts_on):
    whole = list(sp.simulate(sensed_scene(acts_on, Sensor(0.01)), solver, DT, 5))
    sensor = Sensor(0.01)
    frames = sp.simulate(sensed_scene(acts_on, sensor), solver, DT, 5, sinks=[sp.RunFolder(out, solver)])
    for _ in range(3):
        next(frames)
    sensor.broken = True
    with pytest.raises(SceneError, match=rf"{acts_on} o[fn] body 'cube': .*\(0\.0\d*\) is not finite"):
        next(frames)
    assert not is_locked(out)
    assert last_state(out).positions.tobytes() == whole[2].state.positions.tobytes()
    rest = list(sp.resume(out, sensed_scene(acts_on, Sensor(0.01)), solver))
    assert all(map(same_bits, whole[3:], rest))
    assert len(rest) == 2


@pytest.mark.parametrize(
    ("control", "error", "words"),
    [
        (lambda frame: {"hand": (np.nan, 0, 0)}, SceneError, "input 'hand' is not finite"),
        (lambda frame: {"foot": (0, 0, 0)}, SceneError, "input 'foot' does not exist"),
        (lambda frame: 1 / 0, ZeroDivisionError, "division by zero"),
    ],
    ids=["nan", "unknown", "exception"],
)
def test_a_control_that_fails_in_mid_run(out, control, error, words):
    solver = sp.XPBD(substeps=4)
    scene = sensed_scene("pin", sp.MotionInput("hand"))

    def failing(frame):
        return control(frame) if frame.index == 3 else {"hand": (0.001 * frame.index, 0, 0)}

    with pytest.raises(error, match=words):
        list(sp.simulate(scene, solver, DT, 5, control=failing, sinks=[sp.RunFolder(out, solver)]))
    assert not is_locked(out)
    assert last_state(out).inputs["hand"].tolist() == [0.002, 0.0, 0.0]
    assert read_journal(RunPaths(out).journal).sessions[-1].last_frame == 3


@pytest.mark.parametrize(
    "make",
    [
        lambda: sp.TetMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, np.nan]], [[0, 1, 2, 3]]),
        lambda: sp.SurfaceMesh([[0, 0, 0], [1, 0, 0], [0, np.inf, 0]], [[0, 1, 2]]),
        lambda: sp.StableNeoHookean(youngs=np.nan, poisson=0.3),
        lambda: sp.StableNeoHookean(youngs=[1e4, np.nan], poisson=0.3),
        lambda: sp.StableNeoHookean(youngs=1e4, poisson=0.3, density=np.inf),
        lambda: sp.EdgesAndVolume(edge_compliance=np.nan, volume_compliance=0.0),
        lambda: sp.Body("cube", MESH, SOFT, velocity=(0, np.nan, 0)),
        lambda: sp.HalfSpace(friction=np.nan),
        lambda: sp.Scene([sp.Body("cube", MESH, SOFT)], gravity=(0, np.nan, 0)),
        lambda: sp.Force("cube", [0], (np.nan, 0, 0)),
        lambda: sp.Keyframes([0, 1], displacements=[(0, 0, 0), (np.nan, 0, 0)]),
    ],
)
def test_nan_in_what_a_scene_is_made_of_is_one_line(make):
    with pytest.raises(SuppleError) as caught:
        make()
    assert "finite" in str(caught.value)


@pytest.mark.parametrize("given", ["positions", "velocities", "state"])
def test_nan_in_the_start_leaves_no_folder(out, given):
    values = np.zeros((len(MESH.vertices), 3))
    values[3, 1] = np.nan
    scene, solver = sensed_scene("pin", None), sp.XPBD()
    options = {f"initial_{given}": {"cube": values}} if given != "state" else {}
    if given == "state":
        options["start"] = State(0.0, MESH.vertices, values)
    with pytest.raises(SceneError, match="not finite"):
        sp.simulate(scene, solver, DT, 5, sinks=[sp.RunFolder(out, solver)], **options)
    assert not out.exists()


@pytest.mark.parametrize("name", ["xpbd", "implicit"])
def test_nan_within_a_solver_is_a_status_and_the_last_good_state_is_kept(out, monkeypatch, name):
    """From the fourth frame on, a material's kernel returns NaN for one vertex."""
    solver = sp.XPBD(substeps=4) if name == "xpbd" else sp.Implicit()
    scene = sensed_scene("pin", circling)
    healthy = list(sp.simulate(scene, solver, DT, 6))
    frames = sp.simulate(scene, solver, DT, 6, sinks=[sp.RunFolder(out, solver)])
    for _ in range(3):
        good = next(frames)
    with monkeypatch.context() as patch:
        if name == "xpbd":
            push = SubstepRunner._push  # comes before the constraints

            def spoiled(self, now, last):
                push(self, now, last)
                now.points[0, 1] = np.nan

            patch.setattr(SubstepRunner, "_push", spoiled)
        else:
            model = Elasticity.add_model

            def spoiled(self, x, gradient, *rest):
                energy = model(self, x, gradient, *rest)
                gradient[0, 1] = np.nan
                return energy

            patch.setattr(Elasticity, "add_model", spoiled)
        rest = list(frames)
    assert [frame.report.status for frame in rest] == [sp.Status.NOT_FINITE]
    assert rest[0].report.message
    assert same_bits(rest[0], good), "the last good state, and its time"
    assert last_state(out).positions.tobytes() == good.state.positions.tobytes()
    session = read_journal(RunPaths(out).journal).sessions[-1]
    assert (session.outcome, session.message.split(":")[0]) == ("stopped", "not_finite")
    assert all(map(same_bits, healthy[3:], sp.resume(out, scene, solver))), "without the fault it resumes"


@pytest.mark.parametrize("kind", ["pcg", "auto"])
def test_cg_that_cannot_converge(out, monkeypatch, caplog, kind):
    solver = sp.Implicit(linear_solver=kind)
    scene = stitched_scene()
    whole = list(sp.simulate(scene, solver, DT, 4))
    frames = sp.simulate(scene, solver, DT, 4, sinks=[sp.RunFolder(out, solver)])
    for _ in range(2):
        good = next(frames)

    def stalls(preconditioner, b, x, *rest):
        x[:] = 0.0
        return CGResult(10, False, False, 1.0)

    with monkeypatch.context() as patch, caplog.at_level(logging.DEBUG, "supple"):
        patch.setattr(linear_solver, "conjugate_gradients", stalls)
        frame = next(frames)
    if kind == "auto":
        assert "CG stalled after 10 iterations; factorizing" in caplog.text
        assert frame.report.status == "converged"
        assert np.abs(frame.state.positions - whole[2].state.positions).max() < 1e-4
        frames.close()
        return
    assert frame.report.status == "not_finite"
    assert "the linear system that moves the pins could not be solved" in frame.report.message
    assert same_bits(frame, good)
    assert list(frames) == []
    assert last_state(out).positions.tobytes() == good.state.positions.tobytes()
    assert all(map(same_bits, whole[2:], sp.resume(out, scene, solver)))


def mounted(folder, size):
    """Mount a file system of that size in memory, or give one another size; whether this is allowed here."""
    folder.mkdir(exist_ok=True)
    options = f"size={size}" if not folder.is_mount() else f"remount,size={size}"
    command = ["mount", "-t", "tmpfs", "-o", options, "none", str(folder)]
    try:
        return subprocess.run(command, capture_output=True).returncode == 0
    except OSError:
        return False


@pytest.fixture
def small_disk(tmp_path):
    disk = tmp_path / "disk"
    if not mounted(disk, "64k"):
        pytest.skip("mounting is not allowed here; test_a_full_disk_at_any_write_of_the_recording is without")
    yield disk
    subprocess.run(["umount", "-l", str(disk)], check=True)


def test_a_disk_that_is_full_at_whatever_write_and_then_has_room(small_disk):
    """A file system that grows by a page or two at a time is full at another write each time."""
    steps = 30
    whole = list(sp.simulate(drifting_scene(), Drift(), DT, steps))
    run = small_disk / "run"
    errors = []
    for kilobytes in range(4, 120, 8):
        assert mounted(small_disk, f"{kilobytes}k")
        begun = RunPaths(run).journal.exists()
        try:
            if begun:
                list(sp.resume(run, drifting_scene(), Drift()))
            else:
                kept(run, drifting_scene(), Drift(), steps=steps, checkpoint_every=1, overwrite=True)
            break
        except OutputError as error:
            errors.append(str(error))
        assert not run.exists() or not is_locked(run)
    for error in errors:
        assert "No space left on device" in error
        assert "\n" not in error
    assert len({error.split(":")[0] for error in errors}) > 2, "it was full at several files"
    assert mounted(small_disk, "16m")
    if read_journal(RunPaths(run).journal).sessions[-1].last_frame < steps:
        list(sp.resume(run, drifting_scene(), Drift()))
    with sp.read_recording(run / "recording.vtkhdf") as recording:
        assert len(recording) == steps + 1
        assert all(map(same_bits, whole, list(recording)[1:]))
