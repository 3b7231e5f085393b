"""What the shell's exit code says."""

from __future__ import annotations

from enum import IntEnum


class ExitCode(IntEnum):
    """How a command ended."""

    OK = 0
    FAILED = 1
    """A check of a recording failed."""
    INPUT = 2
    """The input, the options or the place for the output cannot be used: one line on stderr says why."""
    SOLVER = 3
    """The solver could not go on: what was recorded up to there is whole."""
    INTERRUPTED = 130
    """Ctrl-C: what was recorded up to there is whole."""
    BROKEN_PIPE = 141
    """Whoever read our output has gone, as in `supple info mesh.stl | head -1`."""
