"""The exit codes of the shell."""

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
