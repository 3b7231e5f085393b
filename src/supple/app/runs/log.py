"""`run.log`: a line for each event of a run, and every warning of the library meanwhile."""

from __future__ import annotations

import logging
import threading
from pathlib import Path

_LIBRARY = logging.getLogger("supple")
_FORMAT = logging.Formatter("%(asctime)s %(levelname)s %(message)s")


class RunLog:
    """Appends to a log file until `close`. A line that cannot be written is lost: the run matters more.

    Parameters
    ----------
    path : of the file, in a folder that exists
    """

    def __init__(self, path: Path) -> None:
        self._handler = _QuietHandler(path, encoding="utf-8", delay=True)
        self._handler.setFormatter(_FORMAT)
        thread = threading.get_ident()
        self._handler.addFilter(lambda record: record.thread == thread)  # another thread may run another simulation
        _LIBRARY.addHandler(self._handler)

    def note(self, text: str) -> None:
        """Write one line, to this file only."""
        self._handler.handle(logging.LogRecord("supple.app.runs", logging.INFO, "", 0, text, (), None))

    def close(self) -> None:
        """Close the file."""
        _LIBRARY.removeHandler(self._handler)
        self._handler.close()


class _QuietHandler(logging.FileHandler):
    def handleError(self, record: logging.LogRecord) -> None:
        """Do nothing; logging itself would print a traceback."""

    def emit(self, record: logging.LogRecord) -> None:
        try:
            super().emit(record)
        except OSError:  # from opening the file
            self.handleError(record)
