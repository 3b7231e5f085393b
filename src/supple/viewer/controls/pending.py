"""What a visitor has asked for, until the simulation has dealt with it."""

from __future__ import annotations

import math
import time

# How long after a visitor's touch an input is left alone, even where the simulation has dealt with it [s]: who moves a
# slider goes on moving it.
_KEEP_SECONDS = 1.0
# A command that was dropped on the way is never dealt with [s].
_LONGEST = 60.0


class PendingValue:
    """Whether an input still shows what its visitor wants, and not yet what the simulation has.

    A simulation that is amid a long step still tells of the value from before.
    """

    def __init__(self) -> None:
        self._touched = -math.inf
        self._number = 0

    def made(self, number: int) -> None:
        """A visitor has asked for something, by the command of that number."""
        self._touched, self._number = time.monotonic(), number

    def stands(self, applied: int) -> bool:
        """Whether it is to be left on show, where the simulation has acted upon the commands up to `applied`."""
        since = time.monotonic() - self._touched
        return since < _KEEP_SECONDS or (applied < self._number and since < _LONGEST)
