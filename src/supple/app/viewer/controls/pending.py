"""The input value of a visitor, while the simulation has not executed its command."""

from __future__ import annotations

import math
import time

# An input of a visitor is kept for this time, even after the simulation has executed its command [s], because a visitor
# who moves a slider continues to move it.
_KEEP_SECONDS = 1.0
# A dropped command is never executed: its value is kept for this time [s].
_LONGEST = 60.0


class PendingValue:
    """Tells whether an input keeps the value of a visitor instead of the value of the simulation.

    During a long step the snapshots still contain the old value.
    """

    def __init__(self) -> None:
        self._changed = -math.inf
        self._number = 0

    def requested(self, number: int) -> None:
        """Store the number of the command that a visitor has sent."""
        self._changed, self._number = time.monotonic(), number

    def is_pending(self, applied: int) -> bool:
        """Whether the value is kept, where the simulation has executed the commands up to `applied`."""
        since = time.monotonic() - self._changed
        return since < _KEEP_SECONDS or (applied < self._number and since < _LONGEST)
