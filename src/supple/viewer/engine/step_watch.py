"""Giving up a step that takes too long: a solver may need minutes where a person waits for an answer."""

from __future__ import annotations

import _thread
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from supple.errors import SolverError
from supple.viewer.engine.compile_clock import CompileClock

# How often the watch looks at the clock, and after which time it tries again [s].
_LOOK, _AGAIN = 0.05, 0.5


class StepTooLong(SolverError):
    """A step was given up."""


class StepWatch:
    """Ends what the main thread does within `limited`, by an exception, once it takes too long.

    Solvers make new states and leave old ones alone, so that a step can be given up anywhere; only the workspace has to
    be prepared anew. Time in which kernels are compiled does not count, and nothing ends it: given up, it would only
    begin anew.

    Parameters
    ----------
    longest : for one step [s].
    impatient, patience : whether somebody waits, and for how long he has to, once a step runs [s].
    """

    def __init__(self, longest: float, impatient: Callable[[], bool] = lambda: False, patience: float = 1.0) -> None:
        self.longest, self.patience = longest, patience
        self._impatient = impatient
        self._began: float | None = None
        self._compiled = CompileClock()
        self._compiled_before = 0.0
        self._not_before = 0.0
        self._thread: threading.Thread | None = None

    @contextmanager
    def limited(self) -> Iterator[None]:
        """A block that ends with `StepTooLong` where it takes too long. Does nothing outside the main thread."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        if self._thread is None:
            self._thread = threading.Thread(target=self._watch, name="step watch", daemon=True)
            self._thread.start()
        before = signal.signal(signal.SIGINT, self._give_up)
        self._compiled_before, self._not_before = self._compiled.seconds, 0.0
        self._began = time.monotonic()
        try:
            yield
        finally:
            self._began = None
            signal.signal(signal.SIGINT, before)

    def _give_up(self, number: int, frame: Any) -> None:
        # Ctrl-C in a terminal comes here as well, and is left to the page's process.
        began = self._began
        if began is None or not self._is_over(began):
            return
        # It may have been raised where nobody lets it pass, as in a destructor: then once more, a little later.
        self._not_before = time.monotonic() + _AGAIN
        raise StepTooLong(f"given up after {time.monotonic() - began:.1f} s")

    def _is_over(self, began: float) -> bool:
        now = time.monotonic()
        taken = now - began - (self._compiled.seconds - self._compiled_before)
        if now < self._not_before or self._compiled.running:
            return False
        return taken > self.longest or (taken > self.patience and self._impatient())

    def _watch(self) -> None:
        while True:
            time.sleep(_LOOK)
            began = self._began
            if began is not None and self._is_over(began):
                _thread.interrupt_main(signal.SIGINT)
