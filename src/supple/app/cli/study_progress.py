"""The progress of a study in a terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING, Self

from supple.app.studies.runner import StudyProgress

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress


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
