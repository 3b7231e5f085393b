"""`supple sweep`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from supple.app.cli.numbers import Steps


def sweep(
    study: Path,
    /,
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"])] = Path("study"),
    workers: Steps = None,
    scheduler: str | None = None,
    retry_failed: Annotated[bool, Parameter(negative="")] = False,
    plot: bool = True,
    quiet: Annotated[bool, Parameter(name=["--quiet", "-q"], negative="")] = False,
) -> int:
    """Simulate a scene with many values of its parameters, and write one table of results.

    Cases that have ended are not simulated again: the same command continues an interrupted study.

    Parameters
    ----------
    study
        The study file (.yaml): scene file, factors, design and measures; docs/reference/studies.md describes it.
    output
        Folder for table.csv, plots, and a folder for each case.
    workers
        Number of processes on this machine; without this, one per core. Fewer are used where the memory requires it.
    scheduler
        Address of a scheduler of dask.distributed, such as tcp://node1:8786, instead of processes on this machine.
    retry_failed
        Simulate cases again that failed before.
    plot
        Write plots of every measure.
    quiet
        Print neither progress nor summary.
    """
    from supple.app.cli.exit_codes import ExitCode
    from supple.app.cli.study_progress import StudyBar
    from supple.app.studies.plots import plot_study
    from supple.app.studies.study import TABLE, ignore_progress
    from supple.app.studies.study_file import load_study

    described = load_study(study)
    with StudyBar() as bar:
        table = described.run(
            output,
            workers=workers,
            scheduler=scheduler,
            retry_failed=retry_failed,
            progress=ignore_progress if quiet else bar.show,
        )
    plots = plot_study(table, output / "plots") if plot else []
    failed = [(key, reason) for key, reason in zip(table.keys, table.reasons, strict=True) if reason]
    if not quiet:
        from rich.markup import escape

        from supple.app.cli.console import shell_console

        console = shell_console()
        console.print(f"{len(table)} cases: {len(table) - len(failed)} done, {len(failed)} failed")
        for key, reason in failed[:5]:
            console.print(f"  {key}: {escape(reason)}")
        console.print(f"table  {escape(str(output / TABLE))}")
        if plots:
            console.print(f"plots  {escape(str(output / 'plots'))}")
    return ExitCode.FAILED if failed else ExitCode.OK
