"""Warnings of the library, of which the page displays each one once."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager


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
