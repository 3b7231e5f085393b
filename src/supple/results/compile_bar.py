"""A bar on standard error while a command compiles kernels, so that no wait is silent."""

from __future__ import annotations

from typing import TYPE_CHECKING

from supple.runtime.kernel_count import KernelCount

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress


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
