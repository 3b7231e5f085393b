"""The console for the shell's tables and texts on standard output."""

from __future__ import annotations

from collections.abc import Iterable

from rich.console import Console
from rich.markup import escape


class ShellConsole(Console):
    """A rich console that raises an error where the reader has ended, instead of ending the process; see `main`."""

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError


def shell_console() -> Console:
    """The console for the output of commands: numbers are not colored, and long lines are not wrapped."""
    return ShellConsole(highlight=False, soft_wrap=True)


def print_table(rows: Iterable[tuple[str, str]], title: str = "") -> None:
    """Print names and values in two columns. Nothing is parsed as markup: a file may be called [bold]."""
    from rich.table import Table

    table = Table(title=escape(title) or None, title_justify="left", show_header=False, box=None, pad_edge=False)
    table.add_column(style="bold")
    table.add_column(overflow="fold")
    for name, value in rows:
        table.add_row(escape(name), escape(value))
    ShellConsole().print(table)
