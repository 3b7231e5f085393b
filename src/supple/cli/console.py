"""The console for the shell's tables and texts on standard output."""

from __future__ import annotations

from rich.console import Console


class ShellConsole(Console):
    """A rich console that raises an error where the reader has ended, instead of ending the process; see `main`."""

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError


def shell_console() -> Console:
    """The console for the output of commands: numbers are not colored, and long lines are not wrapped."""
    return ShellConsole(highlight=False, soft_wrap=True)
