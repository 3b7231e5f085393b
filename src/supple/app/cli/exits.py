"""How a command ends: its exit code, and an error message on stderr, always on one line."""

import sys
from enum import IntEnum


class ExitCode(IntEnum):
    """How a command ended."""

    OK = 0
    FAILED = 1
    """A check of a recording failed, a claim of a demo does not hold, or a frame did not converge with --strict."""
    INPUT = 2
    """The input, the options or the place for the output cannot be used: one line on stderr tells why."""
    SOLVER = 3
    """The solver could not go on. The recording up to there is complete."""
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
