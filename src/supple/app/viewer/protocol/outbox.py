"""Sends snapshots from the simulation to the page: only the newest one, and without waiting for the reader."""

from __future__ import annotations

import threading
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from typing import Any

# The first byte of a message is its kind; the rest is pickled.
DESCRIPTION, SNAPSHOT, ERROR, PROGRESS = b"d", b"s", b"e", b"p"


def packed(kind: bytes, content: Any) -> bytes:
    """One message."""
    return kind + bytes(ForkingPickler.dumps(content))


class Outbox:
    """Sends through a pipe from its own thread, so that a slow reader blocks only this thread.

    A newer snapshot replaces one that has not been sent yet.
    """

    def __init__(self, pipe: Connection) -> None:
        self._pipe = pipe
        self._description: bytes | None = None
        self._snapshot: bytes | None = None
        self._progress: bytes | None = None
        self._changed = threading.Condition()
        threading.Thread(target=self._send_all, name="outbox", daemon=True).start()

    def put_description(self, description: Any) -> None:
        """Send a description before any snapshot that is put after it."""
        data = packed(DESCRIPTION, description)
        with self._changed:
            self._description, self._snapshot, self._progress = data, None, None
            self._changed.notify()

    def put_snapshot(self, snapshot: Any) -> None:
        """Send a snapshot, unless a newer one replaces it."""
        data = packed(SNAPSHOT, snapshot)
        with self._changed:
            self._snapshot, self._progress = data, None
            self._changed.notify()

    def put_progress(self, progress: Any) -> None:
        """Send the progress of a long step, or None: a heartbeat."""
        data = packed(PROGRESS, progress)
        with self._changed:
            self._progress = data
            self._changed.notify()

    def _send_all(self) -> None:
        while True:
            with self._changed:
                while self._description is None and self._snapshot is None and self._progress is None:
                    self._changed.wait()
                if self._description is not None:
                    data, self._description = self._description, None
                elif self._snapshot is not None:
                    data, self._snapshot = self._snapshot, None
                else:
                    data, self._progress = self._progress, None
            try:
                self._pipe.send_bytes(data or b"")
            except OSError:  # the page is gone; the reader of commands ends this process
                return
