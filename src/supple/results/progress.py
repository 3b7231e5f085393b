"""The progress that a terminal shows: of a simulation by a sink, and of compilation; every wait shows its cause."""

from __future__ import annotations

import multiprocessing
import sys
import time
from functools import cache
from typing import TYPE_CHECKING, ClassVar

from supple.runtime.kernel_count import KernelCount

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

    from supple.results.frame import Frame

_PERIOD = 0.2  # between two lines in a notebook [s]
_STARTING = "starting"
_SMOOTHING = 0.2  # weight of the newest frame in the displayed milliseconds
_PATIENCE = 2.0  # compilation that takes longer is shown without being asked for [s]


@cache
def error_console() -> Console:
    """The console on standard error. There is one: displays that change, as bars, know of each other by it."""
    from rich.console import Console

    return Console(stderr=True)


class ProgressBar:
    """Frames done, milliseconds of each, time left, and how the last step ended.

    In a notebook it is a line that changes. Where the output is neither a terminal nor a notebook (a file, a pipe, CI),
    there is one line at the end. While kernels are compiled, it says so.

    Parameters
    ----------
    console : where to write; standard error by default, so that standard output contains only results.
    """

    running: ClassVar[list[ProgressBar]] = []

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
        self.running.append(self)
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
        self.show(self._status)

    def show(self, status: str) -> None:
        """Show what was done so far, and this status."""
        ms = f"{self._displayed_ms:.1f}" if self._seconds else "-"
        if self._bar is not None:
            self._bar.update(self._task, completed=len(self._seconds), ms=ms, status=status)
        elif self._console is not None and self._console.is_jupyter and time.perf_counter() > self._next_line:
            self._next_line = time.perf_counter() + _PERIOD
            # A carriage return replaces the line: a bar of rich needs ipywidgets there.
            _write_over(f"{len(self._seconds)} of {self._steps} frames, {ms} ms each; {status}")

    def end(self) -> None:
        if self in self.running:  # a sink may be ended that never began
            self.running.remove(self)
        if self._console is not None and self._console.is_jupyter:
            _write_over(self._summary(), "\n")
            return
        if self._bar is not None:
            self._bar.stop()
            self._bar = None
        elif self._console is not None:
            self._console.print(self._summary(), soft_wrap=True, highlight=False, markup=False)

    def _summary(self) -> str:
        frames = len(self._seconds)
        rate = f", {1e3 * sum(self._seconds) / frames:.1f} ms each in the solver" if frames else ""
        seconds = time.perf_counter() - self._start
        return f"{frames} of {self._steps} frames in {seconds:.1f} s{rate}; {self._status}"


def _write_over(text: str, end: str = "") -> None:
    """Replace the line of a notebook."""
    sys.stdout.write(f"\r{text:<60}{end}")
    sys.stdout.flush()


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
    """Shows compilation, kernel by kernel, where standard error is a terminal, or in a notebook.

    Of several, the one that is a block shows it. Where a `ProgressBar` runs, that one does.

    Parameters
    ----------
    patience : how long compilation takes altogether before it is shown [s]
    """

    _blocks: ClassVar[int] = 0

    def __init__(self, patience: float = 0.0) -> None:
        super().__init__()
        self._bar: Progress | None = None
        self._patience, self._spent, self._began = patience, 0.0, 0.0
        self._is_block = self._has_line = False

    def __enter__(self) -> CompileBar:
        self._is_block = True
        CompileBar._blocks += 1
        return self

    def __exit__(self, *_: object) -> None:
        CompileBar._blocks -= 1
        self.close()
        self._stop()

    def changed(self) -> None:
        if not self.compiling:
            self._spent += time.perf_counter() - self._began if self._began else 0.0
            self._began = 0.0
            self._stop()  # what follows may print
            return
        self._began = self._began or time.perf_counter()
        waited = self._spent + time.perf_counter() - self._began
        if waited >= self._patience and (self._is_block or not CompileBar._blocks):
            self._show(waited)

    def _show(self, waited: float) -> None:
        number, total = self.numbers()
        if ProgressBar.running:
            ProgressBar.running[-1].show(f"compiling kernel {number} of {total}, once on this machine")
        elif error_console().is_jupyter:
            _write_over(f"compiling kernel {number} of {total}, once on this machine, {waited:.0f} s")
            self._has_line = True
        elif sys.stderr is not None and sys.stderr.isatty():
            if self._bar is None:
                self._bar = kernel_bar(error_console())
                self._bar.start()
                self._task = self._bar.add_task("", total=None)
                self._bar.tasks[0].start_time = self._bar.get_time() - waited  # of all kernels so far
            self._bar.update(self._task, completed=number, total=total)

    def _stop(self) -> None:
        if self._bar is not None:
            self._bar.stop()
            self._bar = None
        if self._has_line:
            _write_over("", "\r")
            self._has_line = False


def show_compilation() -> None:
    """From now on, show compilation that takes long; not in a process of a study or of the page, which has a caller."""
    if multiprocessing.parent_process() is None:
        CompileBar(_PATIENCE)
