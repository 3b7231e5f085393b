"""A sink that keeps a run in a folder of its own."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from supple.app.runs.contents import RunPaths
from supple.app.runs.journal import Journal
from supple.app.runs.run_writer import RunWriter, facts_of
from supple.errors import OutputError, SceneError
from supple.kinds.validators import POSITIVE
from supple.results.frame import Frame
from supple.results.readings.fields import checked_fields
from supple.results.recording.recorder import Recorder
from supple.runtime.lock import FolderLock
from supple.runtime.replacing import output_error, whole_file
from supple.solvers.auto import Auto
from supple.solvers.solver import Solver

CHECKPOINT_EVERY, CHECKPOINT_SECONDS = 100, 30.0


@dataclass(frozen=True, eq=False)
class SceneSource:
    """Where the scene of a run comes from.

    Attributes
    ----------
    origin : for the journal; a run of another kind than "scene_file" is resumed with its scene
    text : of the scene file as given, for the recording; None where none exists
    files : by their paths in `RunPaths.own`, texts to write, or files to copy
    """

    origin: Mapping[str, Any] = field(default_factory=lambda: {"kind": "python"})
    text: str | None = None
    files: Mapping[str, str | Path] = field(default_factory=dict)


class FolderSink:
    """A sink that locks a folder and passes everything on to a `RunWriter`."""

    def __init__(self, folder: Path) -> None:
        self.paths = RunPaths(folder)
        self._lock: FolderLock | None = None
        self._writer: RunWriter | None = None

    def write(self, frame: Frame) -> None:
        """Record a frame, and write a checkpoint where one is due."""
        if self._writer is None:
            raise OutputError(f"{self.paths.folder}: write was called before begin; let simulate drive the run folder")
        self._writer.write(frame)

    def end(self) -> None:
        """Write the last checkpoint and the tables, close the recording, and unlock the folder."""
        writer, self._writer = self._writer, None
        lock, self._lock = self._lock, None
        try:
            if writer is not None:
                writer.end()
        finally:
            if lock is not None:
                lock.release()


class RunFolder(FolderSink):
    """Keeps a run: `simulate(scene, solver, dt, steps, sinks=[RunFolder("out")])`. `resume` continues it.

    Parameters
    ----------
    folder : is made where it is missing. While the run lasts, no other one can write to it.
    solver : that of the run; without one, that of its frames
    checkpoint_every : number of frames from checkpoint to checkpoint; None: only by the clock, and at the start and the
        end, also where the run stops early. The first checkpoint and the latest two are kept.
    checkpoint_seconds : longest time from checkpoint to checkpoint by the clock [s]; None: only by frames
    overwrite : replace an earlier run in the folder; without it, a folder that contains a recording is an error
    compress : compress the recording when the run ends
    fields : to record in addition; see `Recorder`
    seed : of the random numbers that the scene was made with; kept in the journal
    source : where the scene comes from

    Raises
    ------
    OutputError : from the constructor and `begin` where the folder cannot be used; later, where the system reports an
        error. The recording and the last checkpoint stay as they are.
    """

    def __init__(
        self,
        folder: str | Path,
        solver: Solver | Auto | None = None,
        *,
        checkpoint_every: int | None = CHECKPOINT_EVERY,
        checkpoint_seconds: float | None = CHECKPOINT_SECONDS,
        overwrite: bool = False,
        compress: bool = False,
        fields: Sequence[str] = (),
        seed: int | None = None,
        source: SceneSource | None = None,
    ) -> None:
        super().__init__(Path(folder))
        if checkpoint_every is not None and (
            isinstance(checkpoint_every, bool)
            or not isinstance(checkpoint_every, (int, np.integer))
            or checkpoint_every < 1
        ):
            raise OutputError(
                f"checkpoint_every is {checkpoint_every!r}; give a whole number of one or more, or None for none"
            )
        if checkpoint_seconds is not None:
            try:
                POSITIVE.checked(checkpoint_seconds, "checkpoint_seconds")
            except SceneError as error:
                raise OutputError(str(error)) from None
        self._solver, self._every, self._seconds, self._overwrite = (
            solver,
            checkpoint_every,
            checkpoint_seconds,
            overwrite,
        )
        self._compress, self._seed, self._source = bool(compress), seed, source or SceneSource()
        self._fields = tuple(field.name for field in checked_fields(fields))
        self._refuse()

    def begin(self, first: Frame, dt: float, steps: int) -> None:
        """Lock the folder and write the start to it."""
        solver = self._solver if isinstance(self._solver, Solver) else first.solver
        assert solver is not None
        journal = Journal(
            run=facts_of(first.system, (first.index, first.time), dt, steps, solver),
            origin={**self._source.origin, **({"solver_chosen": solver.because} if solver.because else {})},
            seed=self._seed,
            checkpoint_every=None if self._every is None else int(self._every),
            checkpoint_seconds=None if self._seconds is None else float(self._seconds),
            compress=self._compress,
            fields=self._fields,
        )
        recorder = Recorder(
            self.paths.recording,
            scene_text=self._source.text,
            solver=solver.account,
            compress=self._compress,
            fields=self._fields,
        )
        try:
            self.paths.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise output_error(self.paths.folder, error) from None
        self._lock = FolderLock(self.paths.folder)
        self._refuse()
        try:
            self.paths.remove_run()
            self.paths.own.mkdir(exist_ok=True)
            self._copy_source()
        except OSError as error:
            raise output_error(self.paths.folder, error) from None
        self._writer = RunWriter(self.paths, recorder, journal)
        self._writer.begin(first, dt, steps)

    def _refuse(self) -> None:
        """Raise where the folder cannot be used."""
        self.paths.refuse_other_kinds()
        if not self._overwrite:
            self.paths.refuse_a_run()

    def _copy_source(self) -> None:
        for name, content in self._source.files.items():
            with whole_file(self.paths.own / name) as fresh:
                if isinstance(content, Path):
                    shutil.copyfile(content, fresh)
                else:
                    fresh.write_text(content, encoding="utf-8", newline="\n")
