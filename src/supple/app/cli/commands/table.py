"""`supple table`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from supple.app.cli.arguments import exported


def table(
    run: Path,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
) -> None:
    """Write one row for each frame: energies, momenta, contact and reaction forces, sizes of recorded fields.

    docs/reference/forces_and_stresses.md lists the columns.

    Parameters
    ----------
    run
        Run folder, or a recording (.vtkhdf).
    output
        File to write (.csv); without it, report.csv in the run folder, or beside the recording and under its name.
    """
    print(exported(run, "csv", output, "report.csv"))
