"""Keeps one process's part of a run in a folder that is locked: frames, checkpoints, journal, log and tables."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from supple.app.runs.contents import RunPaths
from supple.app.runs.journal import Journal, Session, now, versions, write_journal
from supple.errors import OutputError
from supple.model.breaking import are_of, without_broken
from supple.model.system import System, rebuilt_system
from supple.results.checkpoint.file import Checkpoint, RunFacts, write_checkpoint
from supple.results.checkpoint.scene_hash import scene_hash
from supple.results.export.exporter import export
from supple.results.frame import Frame, start_frame
from supple.results.recording.recorder import Recorder
from supple.scene.scene import Scene
from supple.solvers.solver import Solver


def facts_of(system: System, start: tuple[int, float], dt: float, steps: int, solver: Solver) -> RunFacts:
    """What a run is that begins with the index and the time [s] `start`, and has this many steps of dt [s]."""
    span = (float(start[1]), float(steps * dt))
    return RunFacts(start[0], int(steps), float(dt), scene_hash(system, *span), span, str(solver))


def checkpoint_of(frame: Frame, run: RunFacts) -> Checkpoint:
    """All that the next step depends on."""
    return Checkpoint(
        run=run,
        index=frame.index,
        state=frame.state,
        start_states=tuple(replace(state, memory=None) for state in frame.system.start_states),
        anchors=tuple(np.asarray(pin.anchors) for pin in frame.system.pins),
        versions=versions(),
    )


def frame_of(checkpoint: Checkpoint, scene: Scene, solver: Solver) -> Frame | None:
    """The frame of a checkpoint; None where the scene is not the one that was run."""
    count = sum(len(body.mesh.vertices) for body in scene.bodies)
    if len(checkpoint.state.positions) != count or len(checkpoint.anchors) != len(scene.pins):
        return None
    system = rebuilt_system(scene, checkpoint.start_states, checkpoint.anchors)
    state = checkpoint.state
    if scene_hash(system, *checkpoint.run.span) != checkpoint.run.scene or not are_of(state, scene):
        return None
    system = without_broken(system, state.broken_stitches, state.separated_stitches)
    return start_frame(system, state, checkpoint.index, solver)


logger = logging.getLogger(__name__)


class RunWriter:
    """A sink for the rest of a run from one frame on.

    Parameters
    ----------
    paths : in the folder; recorder : of the recording in it; journal : of the run so far
    checkpointed : index of the checkpoint that the run resumes from, or -1
    """

    def __init__(self, paths: RunPaths, recorder: Recorder, journal: Journal, checkpointed: int = -1) -> None:
        self.paths, self.recorder, self.journal = paths, recorder, journal
        self.log = RunLog(paths.log)
        self._last: Frame | None = None  # that was recorded
        self._good: Frame | None = None  # the last one that another step may start from
        self._checkpointed = checkpointed
        self._checkpointed_at = time.monotonic()
        self._first_index: int | None = None  # of the session, once it is in the journal
        self._failure = ""  # the error that interrupted `begin` or `write`

    @property
    def run(self) -> RunFacts:
        return self.journal.run

    def begin(self, first: Frame, dt: float, steps: int) -> None:
        with self._watched():
            # In this order, a run can be resumed as soon as it has a journal.
            if self._checkpointed != first.index:
                self._write_checkpoint(first)
            self.journal = self.journal.with_session(Session(first_frame=first.index, last_frame=first.index))
            write_journal(self.paths.journal, self.journal)
            self._first_index = first.index
            self.log.note(f"frame {first.index} of {self.run.last_index}: begins, with {self.run.solver}")
            self.recorder.begin(first, dt, steps)
            self._last = self._good = first

    def write(self, frame: Frame) -> None:
        with self._watched():
            self.recorder.write(frame)
            self._last = frame
            if frame.report.status.can_go_on:
                self._good = frame
                every, seconds = self.journal.checkpoint_every, self.journal.checkpoint_seconds
                late = seconds is not None and time.monotonic() - self._checkpointed_at >= seconds
                if late or (every is not None and frame.index % every == 0):
                    self._write_checkpoint(frame)

    @contextmanager
    def _watched(self) -> Iterator[None]:
        try:
            yield
        except OutputError as error:
            self._failure = str(error)
            raise

    def end(self) -> None:
        """Write the last checkpoint and the tables, and close everything; all that is possible after an error.

        Raises
        ------
        OutputError : where the system refuses for the first time; otherwise, the first error has been raised before.
        """
        first: OutputError | None = None
        try:
            for act in (self._write_last_checkpoint, self.recorder.end, self._end_session, self._write_table):
                try:
                    act()
                except OutputError as error:
                    if self._failure:
                        logger.warning("%s", error)
                    else:
                        first, self._failure = error, str(error)
        finally:
            self.recorder.end()
            self.log.close()
        if first is not None:
            raise first

    def _write_last_checkpoint(self) -> None:
        is_there = self.paths.checkpoint_folder.is_dir()  # where somebody has removed it, it is not made again
        if self._good is not None and self._good.index != self._checkpointed and is_there:
            self._write_checkpoint(self._good)

    def _end_session(self) -> None:
        if self._first_index is None or not self.paths.own.is_dir():
            return
        outcome, message = self._outcome()
        index = self._first_index if self._last is None else self._last.index
        ended = self.journal.with_last(ended=now(), last_frame=index, outcome=outcome, message=message)
        write_journal(self.paths.journal, ended)
        self.log.note(f"frame {index} of {self.run.last_index}: {outcome}{message and ': '}{message}")

    def _write_table(self) -> None:
        if self._last is not None and self.paths.recording.exists():
            export(self.paths.recording, "csv", self.paths.table)

    def _outcome(self) -> tuple[str, str]:
        """How the session ended, and why."""
        if self._failure or self._last is None:
            return "failed", self._failure
        report = self._last.report
        if not report.status.can_go_on:
            return "stopped", f"{report.status}: {report.message}"
        return ("finished" if self._last.index == self.run.last_index else "interrupted"), ""

    def _write_checkpoint(self, frame: Frame) -> None:
        """Write a frame that was recorded."""
        self.recorder.sync()  # a power failure must not leave a checkpoint without its frame
        write_checkpoint(self.paths.checkpoint(frame.index), checkpoint_of(frame, self.run))
        self._checkpointed, self._checkpointed_at = frame.index, time.monotonic()
        self.paths.remove_old_checkpoints()
        self.log.note(f"frame {frame.index}: checkpoint")


_LIBRARY = logging.getLogger("supple")
_FORMAT = logging.Formatter("%(asctime)s %(levelname)s %(message)s")


class RunLog:
    """Appends to a log file until `close`. A line that cannot be written is lost: the run matters more.

    Parameters
    ----------
    path : of the file, in a folder that exists
    """

    def __init__(self, path: Path) -> None:
        self._handler = _QuietHandler(path, encoding="utf-8", delay=True)
        self._handler.setFormatter(_FORMAT)
        thread = threading.get_ident()
        self._handler.addFilter(lambda record: record.thread == thread)  # another thread may run another simulation
        _LIBRARY.addHandler(self._handler)

    def note(self, text: str) -> None:
        """Write one line, to this file only."""
        self._handler.handle(logging.LogRecord("supple.app.runs", logging.INFO, "", 0, text, (), None))

    def close(self) -> None:
        """Close the file."""
        _LIBRARY.removeHandler(self._handler)
        self._handler.close()


class _QuietHandler(logging.FileHandler):
    def handleError(self, record: logging.LogRecord) -> None:
        """Do nothing; logging itself would print a traceback."""

    def emit(self, record: logging.LogRecord) -> None:
        try:
            super().emit(record)
        except OSError:  # from opening the file
            self.handleError(record)
