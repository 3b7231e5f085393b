"""How long kernels have been compiled for: once on every machine, and no part of a step."""

from __future__ import annotations

import time
from typing import Any

from numba.core import event


class CompileClock(event.Listener):
    """Adds up the time [s] that Numba compiles, in any thread, since this was made."""

    def __init__(self) -> None:
        self._depth = 0  # kernels that call others compile them, too
        self._began = self._before = 0.0
        event.register("numba:compile", self)

    def on_start(self, event: Any) -> None:
        """Called by Numba."""
        if self._depth == 0:
            self._began = time.monotonic()
        self._depth += 1

    def on_end(self, event: Any) -> None:
        """Called by Numba."""
        self._depth -= 1
        if self._depth == 0:
            self._before += time.monotonic() - self._began

    @property
    def running(self) -> bool:
        """Whether something is being compiled now."""
        return self._depth > 0

    @property
    def seconds(self) -> float:
        """Until now."""
        return self._before + (time.monotonic() - self._began if self.running else 0.0)
