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

_LOOK = 0.05  # how often the watch looks at the clock [s]


class StepTooLong(SolverError):
    """A step was given up."""


class StepWatch:
    """Ends what the main thread does within `limited`, by an exception, once it takes too long.

    Solvers make new states and leave old ones alone, so that a step can be given up anywhere; only the workspace has to
    be prepared anew.

    Parameters
    ----------
    longest : for one step [s].
    impatient, patience : whether somebody waits, and for how long he has to, once a step runs [s].
    """

    def __init__(self, longest: float, impatient: Callable[[], bool] = lambda: False, patience: float = 1.0) -> None:
        self.longest, self.patience = longest, patience
        self._impatient = impatient
        self._began: float | None = None
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
        self._began = time.monotonic()
        try:
            yield
        finally:
            self._began = None
            signal.signal(signal.SIGINT, before)

    def _give_up(self, number: int, frame: Any) -> None:
        # Ctrl-C in a terminal comes here as well, and is left to the page's process.
        began, self._began = self._began, None
        if began is None or not self._is_over(began):
            self._began = began
            return
        raise StepTooLong(f"given up after {time.monotonic() - began:.1f} s")

    def _is_over(self, began: float) -> bool:
        taken = time.monotonic() - began
        return taken > self.longest or (taken > self.patience and self._impatient())

    def _watch(self) -> None:
        while True:
            time.sleep(_LOOK)
            began = self._began
            if began is not None and self._is_over(began):
                _thread.interrupt_main(signal.SIGINT)
