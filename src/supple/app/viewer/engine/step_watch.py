"""Gives up a step that takes too long: a solver may need minutes where a person waits for an answer."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from numba.core import event

from supple.app.viewer.protocol.snapshots import Progress
from supple.errors import SolverError
from supple.runtime.interruption import interruptible
from supple.runtime.kernel_count import KernelCount


@contextmanager
def warnings_as_notices(notify: Callable[[str, str], None]) -> Iterator[None]:
    """A block in which each warning of the library becomes a notice, given as its level and text, once."""
    log, handler = logging.getLogger("supple"), _Notices(notify)
    propagated, log.propagate = log.propagate, False
    log.addHandler(handler)
    try:
        yield
    finally:
        log.removeHandler(handler)
        log.propagate = propagated


class _Notices(logging.Handler):
    """Errors go to the terminal: they are faults of the code."""

    def __init__(self, notify: Callable[[str, str], None]) -> None:
        super().__init__(logging.WARNING)
        self.notify = notify
        self.received: set[str] = set()

    def emit(self, record: logging.LogRecord) -> None:
        text = " ".join(record.getMessage().split())[:500]
        if record.levelno >= logging.ERROR:
            logging.getLogger().handle(record)
        elif text not in self.received and len(self.received) < 1000:
            self.received.add(text)
            self.notify("info", text)


class StepWatch:
    """Ends a computation by an exception once it takes too long, at the next interruption point of the solver.

    Solvers create new states and do not change old ones. After an interruption only the workspace has to be prepared
    again. The time in which kernels are compiled does not count: an interrupted compilation would start from zero.

    Parameters
    ----------
    longest : limit for one step [s].
    is_awaited, longest_awaited : whether a person waits for the end of the step, and the limit in this case [s].
    """

    def __init__(
        self, longest: float, is_awaited: Callable[[], bool] = lambda: False, longest_awaited: float = 1.0
    ) -> None:
        self.longest, self.longest_awaited = longest, longest_awaited
        self._is_awaited = is_awaited
        self._compiled, self._kernels = CompileClock(), KernelCount()
        self._began: float | None = None
        self._rounds = 0

    @contextmanager
    def limited(self, at_each: Callable[[], None] = lambda: None) -> Iterator[None]:
        """A block that ends with a `SolverError` where it takes too long; `at_each` is called where it could end."""
        began, compiled = time.monotonic(), self._compiled.seconds
        self._began, self._rounds = began, 0

        def check() -> None:
            self._rounds += 1
            seconds = time.monotonic() - began - (self._compiled.seconds - compiled)
            if seconds > self.longest or (seconds > self.longest_awaited and self._is_awaited()):
                raise SolverError(f"given up after {seconds:.1f} s")
            at_each()

        try:
            with interruptible(check):
                yield
        finally:
            self._began = None

    @property
    def progress(self) -> Progress | None:
        """Of the current computation; None where none exists. Another thread may ask."""
        running = self._began is not None
        return Progress(self.seconds, self._rounds, self._kernels.current()) if running else None

    @property
    def seconds(self) -> float:
        """Of the current computation so far [s]; 0 where none exists."""
        began = self._began
        return 0.0 if began is None else time.monotonic() - began


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
