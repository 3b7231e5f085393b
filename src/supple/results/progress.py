"""The progress that a terminal shows: of a simulation by a sink, and of compilation; every wait shows its cause."""

from __future__ import annotations

import sys
import time
from functools import cache
from typing import TYPE_CHECKING

from supple.runtime.kernel_count import KernelCount

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

    from supple.results.frame import Frame

_PERIOD = 0.2  # between two lines in a notebook [s]
_STARTING = "starting"
_SMOOTHING = 0.2  # weight of the newest frame in the displayed milliseconds


@cache
def error_console() -> Console:
    """The console on standard error. There is one: displays that change, as bars, know of each other by it."""
    from rich.console import Console

    return Console(stderr=True)


class ProgressBar:
    """Frames done, milliseconds of each, time left, and how the last step ended.

    In a notebook it is a line that changes. Where the output is neither a terminal nor a notebook (a file, a pipe, CI),
    there is one line at the end.

    Parameters
    ----------
    console : where to write; standard error by default, so that standard output contains only results.
    """

    def __init__(self, console: Console | None = None) -> None:
        self._console = console
        self._bar: Progress | None = None
        self._start, self._steps, self._status = 0.0, 0, ""
        self._seconds: list[float] = []  # of each step, in the solver
        self._displayed_ms = self._next_line = 0.0

    def begin(self, first: Frame, dt: float, steps: int) -> None:
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        if self._console is None:
            self._console = error_console()
        self._start, self._steps, self._status = time.perf_counter(), steps, _STARTING
        self._seconds.clear()
        if self._console.is_terminal:
            columns = (
                BarColumn(),
                MofNCompleteColumn(),
                TextColumn("frames  {task.fields[ms]} ms each"),
                TimeRemainingColumn(),
                TextColumn("{task.fields[status]}"),
            )
            self._bar = Progress(*columns, console=self._console)
            self._bar.start()
            self._task = self._bar.add_task("", total=steps, ms="-", status=self._status)

    def write(self, frame: Frame) -> None:
        report = frame.report
        ms = 1e3 * report.wall_seconds
        self._displayed_ms += (_SMOOTHING if self._seconds else 1.0) * (ms - self._displayed_ms)
        self._seconds.append(report.wall_seconds)
        self._status = str(report.status)
        if self._bar is not None:
            self._bar.update(
                self._task, completed=len(self._seconds), ms=f"{self._displayed_ms:.1f}", status=self._status
            )
        elif self._console is not None and self._console.is_jupyter and time.perf_counter() > self._next_line:
            self._next_line = time.perf_counter() + _PERIOD
            frames = f"{len(self._seconds)} of {self._steps} frames"
            # A carriage return replaces the line: a bar of rich needs ipywidgets there.
            sys.stdout.write(f"\r{frames}, {self._displayed_ms:.1f} ms each; {self._status}{' ' * 12}")
            sys.stdout.flush()

    def end(self) -> None:
        if self._console is not None and self._console.is_jupyter:
            sys.stdout.write(f"\r{self._summary()}{' ' * 12}\n")
            return
        if self._bar is not None:
            self._bar.stop()
            self._bar = None
        elif self._console is not None:
            self._console.print(self._summary(), soft_wrap=True, highlight=False, markup=False)

    def _summary(self) -> str:
        frames = len(self._seconds)
        each = f", {1e3 * sum(self._seconds) / frames:.1f} ms each in the solver" if frames else ""
        seconds = time.perf_counter() - self._start
        return f"{frames} of {self._steps} frames in {seconds:.1f} s{each}; {self._status}"


def kernel_bar(console: Console) -> Progress:
    """A bar of kernels, not started. It disappears at its end, and leaves standard output as it is."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("compiling kernels, once on this machine"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    return Progress(*columns, console=console, transient=True, redirect_stdout=False, redirect_stderr=False)


class CompileBar(KernelCount):
    """A block in which compilation is shown, kernel by kernel, where standard error is a terminal."""

    def __init__(self) -> None:
        super().__init__()
        self._bar: Progress | None = None

    def __enter__(self) -> CompileBar:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
        self._stop()

    def changed(self) -> None:
        if not self.compiling:
            self._stop()  # what follows may print
            return
        if self._bar is None:
            from supple.results.progress import error_console

            if not error_console().is_terminal:
                return
            self._bar = kernel_bar(error_console())
            self._bar.start()
            self._task = self._bar.add_task("", total=None)
        number, total = self.numbers()
        self._bar.update(self._task, completed=number, total=total)

    def _stop(self) -> None:
        if self._bar is not None:
            self._bar.stop()
            self._bar = None
