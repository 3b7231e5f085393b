"""The time that Numba spends compiling kernels: once on every machine; it is not part of a step."""

from __future__ import annotations

import time
from typing import Any

from numba.core import event


class CompileClock(event.Listener):
    """The total time [s] that Numba compiles, in any thread, since this object was created."""

    def __init__(self) -> None:
        self._depth = 0  # compilations are nested
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
        """Whether Numba compiles now."""
        return self._depth > 0

    @property
    def seconds(self) -> float:
        """The total until now."""
        return self._before + (time.monotonic() - self._began if self.running else 0.0)
