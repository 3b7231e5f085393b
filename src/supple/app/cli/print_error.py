"""Error messages on stderr, always on one line."""

from __future__ import annotations

import sys


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
