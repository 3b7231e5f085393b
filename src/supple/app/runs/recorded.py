"""Simulating into a recording alone, as studies do: with one checkpoint beside it as long as it is not complete."""

from __future__ import annotations

import logging
import time
from pathlib import Path

from supple.app.runs.journal import differences, versions
from supple.app.runs.run_writer import checkpoint_of, facts_of, frame_of
from supple.app.scene_file.loader import Run
from supple.errors import SuppleError
from supple.results.checkpoint.file import RunFacts, read_checkpoint, write_checkpoint
from supple.results.frame import Frame
from supple.results.recording.continued import ContinuedRecorder
from supple.results.recording.recorder import Recorder
from supple.simulate import simulate

logger = logging.getLogger(__name__)


class CheckpointSink:
    """Keeps the latest frame that a run may resume from, at most once in this many seconds.

    Parameters
    ----------
    path : of the checkpoint; recorder : it has received the frame before
    seconds : from checkpoint to checkpoint
    """

    def __init__(self, path: Path, recorder: Recorder, run: Run, seconds: float) -> None:
        self._path, self._recorder, self._run, self._seconds = path, recorder, run, seconds
        self._facts: RunFacts | None = None
        self._written = time.monotonic()

    def begin(self, first: Frame, dt: float, steps: int) -> None:
        """Nothing is written: a run that takes less time than `seconds` has no checkpoint."""

    def write(self, frame: Frame) -> None:
        """Write a checkpoint where one is due."""
        if not frame.report.status.can_go_on or time.monotonic() - self._written < self._seconds:
            return
        if self._facts is None:
            start = 0, frame.system.start_states[0].time
            self._facts = facts_of(frame.system, start, self._run.dt, self._run.steps, self._run.chosen_solver)
        self._recorder.sync()
        write_checkpoint(self._path, checkpoint_of(frame, self._facts))
        self._written = time.monotonic()

    def end(self) -> None:
        """The checkpoint stays where the run has not ended; `simulate_recorded` deletes it otherwise."""


def simulate_recorded(run: Run, recording: Path, checkpoint: Path, checkpoint_seconds: float) -> tuple[int, str]:
    """Simulate and record a run; the number of frames, and why it stopped early.

    Where an earlier process was killed, the run resumes from the checkpoint; that changes no bit of the recording.

    Raises
    ------
    SuppleError : where it cannot be simulated or recorded.
    """
    first = _interrupted(run, recording, checkpoint)
    if first is None:
        checkpoint.unlink(missing_ok=True)
        compress, fields = run.output.compress, run.output.fields
        recorder = Recorder(recording, scene_text=run.text, compress=compress, fields=fields)
    else:
        recorder = ContinuedRecorder(recording, compress=run.output.compress)
    positions = (run.initial_positions or None) if first is None else None
    done = first.index if first is not None else 0
    sinks = [recorder, CheckpointSink(checkpoint, recorder, run, checkpoint_seconds)]
    index, problem = done, ""
    frames = simulate(
        run.scene, run.chosen_solver, run.dt, run.steps - done, initial_positions=positions, start=first, sinks=sinks
    )
    for frame in frames:
        index = frame.index
        if not frame.report.status.can_go_on:
            problem = f"frame {index}: {frame.report.status}: {frame.report.message}"
    checkpoint.unlink(missing_ok=True)
    return index, problem


def _interrupted(run: Run, recording: Path, path: Path) -> Frame | None:
    """The frame to resume from; None where the run has to begin."""
    if not path.exists() or not recording.exists():
        return None
    try:
        checkpoint = read_checkpoint(path)
        facts = checkpoint.run
        same = (facts.dt, facts.steps, facts.solver) == (run.dt, run.steps, str(run.chosen_solver))
        changed = differences(checkpoint.versions, versions())
        frame = frame_of(checkpoint, run.scene, run.chosen_solver) if same and not changed else None
    except SuppleError as error:
        logger.warning("%s", error)
        return None
    if frame is None:
        logger.warning("%s: is of another run or of other versions; the run begins again", path)
    return frame
