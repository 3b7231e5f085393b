"""`--trace`: every iteration of Newton's method, as a table in a CSV file."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from supple.errors import OutputError, SolverError
from supple.results.frame import Frame
from supple.runtime.replacing import parent_folder, whole_file
from supple.solvers.auto import Auto
from supple.solvers.implicit.details import ImplicitDetails
from supple.solvers.implicit.newton.trace import NewtonRow, trace_csv
from supple.solvers.implicit.solver import Implicit
from supple.solvers.solver import Solver


class NewtonTrace:
    """A sink that keeps the iterations of every frame, and writes them at the end, also where the run stops early.

    Parameters
    ----------
    path : of the CSV file; one row for each iteration: the time at the end of its frame [s], then what `NewtonRow` has.

    Raises
    ------
    OutputError : at the end, where the file cannot be written; at the begin, where its folder cannot be made.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.frames: list[tuple[float, Sequence[NewtonRow]]] = []

    def begin(self, first: Frame, dt: float, steps: int) -> None:
        """Make the folder, and forget the frames of an earlier run."""
        parent_folder(self.path)
        self.frames.clear()

    def write(self, frame: Frame) -> None:
        """Keep the rows of a frame."""
        details = frame.report.details
        assert isinstance(details, ImplicitDetails)
        self.frames.append((frame.time, details.newton))

    def end(self) -> None:
        """Write all rows."""
        with whole_file(self.path) as fresh:
            fresh.write_text(trace_csv(self.frames), encoding="utf-8", newline="\n")


def traces(path: Path | None, solver: Solver | Auto) -> list[NewtonTrace]:
    """The sink for `--trace`; none where the option is not given.

    Raises
    ------
    SolverError : where the solver does not use Newton's method.
    OutputError : where the path is a folder, or is in one that cannot be written to.
    """
    if path is None:
        return []
    if not isinstance(solver, Implicit):
        raise SolverError(
            f"--trace {path}: {type(solver).__name__} does not use Newton's method; use --solver implicit, or leave "
            "--trace out"
        )
    if path.is_dir():
        raise OutputError(f"--trace {path}: is a folder; give the name of a file")
    folder = next(parent for parent in path.absolute().parents if parent.exists())
    if folder.is_dir() and not os.access(folder, os.W_OK):
        raise OutputError(f"--trace {path}: the folder {folder} cannot be written to; give another one")
    return [NewtonTrace(path)]
