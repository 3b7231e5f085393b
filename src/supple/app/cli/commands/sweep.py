"""`supple sweep`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Self

from cyclopts import Parameter

from supple.app.cli.arguments import Steps

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

    from supple.app.studies.study import StudyProgress


def sweep(
    study: Path,
    /,
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"])] = Path("study"),
    workers: Steps = None,
    scheduler: str | None = None,
    retry_failed: Annotated[bool, Parameter(negative="")] = False,
    quiet: Annotated[bool, Parameter(name=["--quiet", "-q"], negative="")] = False,
) -> int:
    """Simulate a scene with many values of its parameters, and write one table of results.

    Cases that have ended are not simulated again: the same command continues an interrupted study.

    Parameters
    ----------
    study
        The study file (.yaml): scene file, factors, design and measures; docs/reference/studies.md describes it.
    output
        Folder for table.csv, and a folder for each case.
    workers
        Number of processes on this machine; without this, one per core.
    scheduler
        Address of a scheduler of dask.distributed, such as tcp://node1:8786, instead of processes on this machine.
    retry_failed
        Simulate cases again that failed before.
    quiet
        Print neither progress nor summary.
    """
    from supple.app.cli.console import ExitCode
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
    failed = [(key, reason) for key, reason in zip(table.keys, table.reasons, strict=True) if reason]
    if not quiet:
        from rich.markup import escape

        from supple.app.cli.console import shell_console

        console = shell_console()
        console.print(f"{len(table)} cases: {len(table) - len(failed)} done, {len(failed)} failed")
        for key, reason in failed[:5]:
            console.print(f"  {key}: {escape(reason)}")
        console.print(f"table  {escape(str(output / TABLE))}")
    return ExitCode.FAILED if failed else ExitCode.OK


class StudyBar:
    """Cases done and failed, and the time left; used in a `with` block.

    Where the output is not a terminal (a file, a pipe, CI), there is nothing before the command's summary.

    Parameters
    ----------
    console : where to write; standard error by default.
    """

    def __init__(self, console: Console | None = None) -> None:
        self._console = console
        self._bar: Progress | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()
            self._bar = None

    def show(self, progress: StudyProgress) -> None:
        """Show the state of the study."""
        ended = progress.done + progress.failed
        texts = {"failed": progress.failed, "left": duration(progress.seconds_left)}
        if self._bar is None:
            from rich.console import Console
            from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

            console = self._console or Console(stderr=True)
            if not console.is_terminal:
                return
            columns = (
                BarColumn(),
                MofNCompleteColumn(),
                TextColumn("cases  {task.fields[failed]} failed  {task.fields[left]} left"),
            )
            self._bar = Progress(*columns, console=console)
            self._bar.start()
            self._task = self._bar.add_task("", total=progress.cases, completed=ended, **texts)
        self._bar.update(self._task, completed=ended, **texts)


def duration(seconds: float | None) -> str:
    """Hours, minutes and seconds, such as "2 h 05 min"; "?" where it is not known."""
    if seconds is None:
        return "?"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes:02d} min"
    return f"{minutes} min {rest:02d} s" if minutes else f"{rest} s"
