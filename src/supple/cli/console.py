"""Where the shell's tables and texts go: standard output, at whatever width it has."""

from __future__ import annotations

from rich.console import Console


class ShellConsole(Console):
    """A rich console that leaves a reader that has gone to `main`, instead of ending the process itself."""

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError


def shell_console() -> Console:
    """For what commands print: no colors for numbers, no wrapping of paths."""
    return ShellConsole(highlight=False, soft_wrap=True)
