"""What the shell prints beside results: tables and texts on standard output, the log, and what takes long."""

from __future__ import annotations

import logging
import os
import sys
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from enum import IntEnum
from typing import TextIO

from rich.console import Console
from rich.markup import escape

from supple.errors import SuppleWarning


class ExitCode(IntEnum):
    """How a command ended."""

    OK = 0
    FAILED = 1
    """A check of a recording failed, a claim of a demo does not hold, or a frame did not converge with --strict."""
    INPUT = 2
    """The input, the options or the place for the output cannot be used: one line on stderr gives the reason."""
    SOLVER = 3
    """The solver could not continue. The recording up to there is complete."""
    INTERRUPTED = 130
    """Ctrl-C, or the request of a system to end. The recording up to there is complete."""
    BROKEN_PIPE = 141
    """The reader of the output has ended, as in `supple info mesh.stl | head -1`."""


def one_line(message: str) -> str:
    """A text on one line, without control characters of terminals."""
    words = " ".join(message.split())
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in words)


def print_error(message: str) -> None:
    """Write `supple: message` to stderr, on one line."""
    if sys.stderr is None:  # closed by the caller
        return
    text = f"supple: {one_line(message)}\n"
    try:
        sys.stderr.write(text)
    except UnicodeEncodeError:
        sys.stderr.write(text.encode("ascii", "backslashreplace").decode("ascii"))


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


# Their lines of the level INFO are for users of the shell, too.
_ANNOUNCED = ("supple.mesh.meshing", "supple.app.scene_file")


class _Handler(logging.StreamHandler):
    """Writes to the current stderr, which a progress line replaces so that lines appear above it."""

    def __init__(self) -> None:
        logging.Handler.__init__(self)

    @property
    def stream(self) -> TextIO:
        return sys.stderr

    def format(self, record: logging.LogRecord) -> str:
        text = super().format(record)
        return text if record.levelno == logging.INFO else f"{record.levelname}: {text}"


def set_up_log(*, quiet: bool) -> None:
    """Log to stderr from the level in the environment variable SUPPLE_LOG on (DEBUG, INFO, ERROR).

    Without it, warnings and, unless `quiet`, what is chosen for meshes.
    """
    given = logging.getLevelNamesMapping().get(os.environ.get("SUPPLE_LOG", "").upper())
    logging.basicConfig(level=logging.WARNING if given is None else given, format="%(message)s", handlers=[_Handler()])
    warnings.filterwarnings("ignore", category=SuppleWarning)  # the log has the same text
    for name in _ANNOUNCED:
        logging.getLogger(name).setLevel(logging.NOTSET if quiet or given is not None else logging.INFO)


@contextmanager
def reading(yes: bool = False, what: str = "reading the scene and making its meshes") -> Iterator[None]:
    """Shows in a terminal that meshes are made; asks where they get very large, unless `yes`."""
    from supple.mesh.meshing.sizes import asking

    console = Console(stderr=True)
    status = console.status(what)

    def ask(question: str) -> bool:
        if yes or not (console.is_terminal and sys.stdin is not None and sys.stdin.isatty()):
            return yes
        status.stop()
        answer = console.input(escape(f"{one_line(question)}. Continue? [y/N] "))
        status.start()
        return answer.strip().lower() in ("y", "yes")

    with asking(ask, "--yes"), status:
        yield
