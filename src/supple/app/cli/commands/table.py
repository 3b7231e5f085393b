"""`supple table`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter


def table(
    run: Path,
    /,
    *,
    to: Literal["csv", "parquet"] = "csv",
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
) -> None:
    """Write one row for each frame: energies, momenta, contact and reaction forces, sizes of recorded fields.

    docs/forces_and_stresses.md lists the columns.

    Parameters
    ----------
    run
        Run folder, or a recording (.vtkhdf).
    to
        csv or parquet.
    output
        File to write; without it, report.csv or report.parquet in the run folder, or beside the recording and under its
        name.
    """
    from supple.app.runs.contents import RunPaths
    from supple.results.export.exporter import export

    if run.is_dir():
        paths = RunPaths(run)
        run = paths.recording
        output = output or next(path for path in paths.tables if path.suffix == f".{to}")
    print(export(run, to, output))
