"""Resuming a run that was interrupted, killed, or finished with too few frames."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from supple.app.runs.contents import RunPaths
from supple.app.runs.journal import Journal, differences, read_journal, versions
from supple.app.runs.run_folder import FolderSink
from supple.app.runs.run_writer import RunWriter, frame_of
from supple.errors import OutputError, SceneError
from supple.results.checkpoint.file import Checkpoint, read_checkpoint
from supple.results.frame import Frame
from supple.results.recording.continued import ContinuedRecorder
from supple.results.recording.reader import read_recording
from supple.results.recording.recorder import Recorder
from supple.runtime.lock import FolderLock, in_use, is_locked
from supple.scene.scene import Scene
from supple.simulate import Control, Frames, Sink, simulate
from supple.solvers.auto import Auto
from supple.solvers.solver import Solver

logger = logging.getLogger(__name__)


class ResumedFolder(FolderSink):
    """Keeps the rest of a run whose beginning is in the folder; see `RunFolder`.

    Parameters
    ----------
    journal : of the run so far, with its intended number of frames
    """

    def __init__(self, folder: Path, journal: Journal) -> None:
        super().__init__(folder)
        self._journal = journal

    def begin(self, first: Frame, dt: float, steps: int) -> None:
        """Lock the folder, and reserve the remaining frames."""
        self._lock = FolderLock(self.paths.folder)
        recorder = self._recorder()
        self._writer = RunWriter(self.paths, recorder, self._journal, checkpointed=first.index)
        self._writer.begin(first, dt, steps)
        self.paths.remove_checkpoints_after(first.index)

    def _recorder(self) -> Recorder:
        """A run that was killed at its very start has no recording yet."""
        paths, journal = self.paths, self._journal
        if paths.recording.exists():
            return ContinuedRecorder(paths.recording, compress=journal.compress)
        text = paths.scene.read_text(encoding="utf-8") if paths.scene.exists() else None
        solver, compress, fields = journal.run.solver, journal.compress, journal.fields
        return Recorder(paths.recording, scene_text=text, solver=solver, compress=compress, fields=fields)


def resume(
    folder: str | Path,
    scene: Scene | None = None,
    solver: Solver | Auto | None = None,
    *,
    steps: int | None = None,
    control: Control | None = None,
    sinks: Sequence[Sink] = (),
) -> Frames:
    """Resume a run from its last checkpoint, in the same folder; yields the frames after it.

    They have the bits that an uninterrupted run would have given, with the same versions of all packages on the same
    machine. The recording continues; its frames after the checkpoint are computed again, and stay where they are equal.

    Parameters
    ----------
    folder : of a run that `RunFolder` or `supple run` has kept
    scene, solver : those of the run, where its scene did not come from a scene file
    steps : new number of frames of the whole run; None: the number that was given to the run
    control : see `simulate`; the inputs of the scene have the values of the checkpoint
    sinks : in addition to the folder; they receive the frames from the checkpoint on

    Raises
    ------
    OutputError : where the folder contains no run, another process writes to it, or the run is complete.
    SceneError, SolverError : where the scene or the solver is not that of the run. Nothing is written.
    """
    paths = RunPaths(Path(folder))
    journal = read_journal(paths.journal)
    if is_locked(paths.folder):
        raise in_use(paths.folder)
    checkpoint = last_checkpoint(paths)
    run, done = checkpoint.run, checkpoint.index - checkpoint.run.first_index
    total = journal.run.steps if steps is None else steps
    if isinstance(total, bool) or not isinstance(total, int) or total <= done:
        raise OutputError(f"{paths.folder}: {done} of {total} frames are there; give a larger number of steps")
    if scene is None:
        scene, solver = _of_scene_file(paths, journal)
    if solver is None:
        raise OutputError(f"{paths.folder}: the scene is given without its solver; give both, as they were run")
    if isinstance(solver, Auto):  # the journal has the choice
        solver = next((one for one in solver.both() if str(one) == run.solver), solver)
    if isinstance(solver, Auto) or str(solver) != run.solver:
        raise OutputError(f"{paths.folder}: was run with {run.solver}; give this solver, not {solver}")
    start = _start(paths, checkpoint, scene, solver)
    changed = differences(checkpoint.versions, versions())
    if changed:
        logger.warning("%s: the last bits may differ, since versions did: %s", paths.folder, changed)
    sink = ResumedFolder(paths.folder, replace(journal, run=replace(run, steps=total)))
    return simulate(scene, solver, run.dt, total - done, start=start, control=control, sinks=[sink, *sinks])


def last_checkpoint(paths: RunPaths) -> Checkpoint:
    """The latest checkpoint that is whole, and whose frame is recorded.

    Raises
    ------
    OutputError : where none exists, or the recording cannot be read.
    """
    recorded = -1
    if paths.recording.exists():
        with read_recording(paths.recording) as recording:
            recorded = recording[-1].index
    for path in paths.checkpoints():
        try:
            checkpoint = read_checkpoint(path)
        except OutputError as error:
            logger.warning("%s", error)
            continue
        if checkpoint.index <= recorded or checkpoint.index == checkpoint.run.first_index:
            return checkpoint
        logger.warning("%s: is later than the recording", path)
    raise OutputError(f"{paths.folder}: has no whole checkpoint, so that the run cannot be resumed; run it again")


def _of_scene_file(paths: RunPaths, journal: Journal) -> tuple[Scene, Solver | Auto]:
    """Scene and solver of the scene file in the folder."""
    if journal.origin.get("kind") != "scene_file":
        raise OutputError(
            f"{paths.folder}: the scene of this run is not a file; give scene and solver: resume(folder, scene, solver)"
        )
    from supple.app.scene_file.loader import load_run
    from supple.contact.start.separation import separate

    described = load_run(paths.scene)
    if journal.origin.get("separate"):
        separation = separate(described.scene, initial_positions=described.initial_positions)
        return separation.scene, described.solver
    return described.scene, described.solver


def _start(paths: RunPaths, checkpoint: Checkpoint, scene: Scene, solver: Solver) -> Frame:
    """The frame of a checkpoint."""
    frame = frame_of(checkpoint, scene, solver)
    if frame is None:
        raise SceneError(f"{paths.folder}: the scene is not the one that was run; give that one, or start another run")
    return frame
