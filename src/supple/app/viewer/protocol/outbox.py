"""Sends snapshots from the simulation to the page: only the newest one, and without waiting for the reader."""

from __future__ import annotations

import threading
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from typing import Any

# The first byte of a message is its kind; the rest is pickled.
DESCRIPTION, SNAPSHOT, ERROR, PROGRESS = b"d", b"s", b"e", b"p"
_ORDER = (DESCRIPTION, SNAPSHOT, PROGRESS, ERROR)


def packed(kind: bytes, content: Any) -> bytes:
    """One message."""
    return kind + bytes(ForkingPickler.dumps(content))


class Outbox:
    """Sends through a pipe from its own thread, so that a slow reader blocks only this thread.

    A newer snapshot replaces one that has not been sent yet.
    """

    def __init__(self, pipe: Connection) -> None:
        self._pipe = pipe
        self._waiting: dict[bytes, bytes] = {}  # by kind
        self._sending = False
        self._changed = threading.Condition()
        threading.Thread(target=self._send_all, name="outbox", daemon=True).start()

    def put_description(self, description: Any) -> None:
        """Send a description before any snapshot that is put after it."""
        self._put(DESCRIPTION, description, (SNAPSHOT, PROGRESS))

    def put_snapshot(self, snapshot: Any) -> None:
        """Send a snapshot, unless a newer one replaces it."""
        self._put(SNAPSHOT, snapshot, (PROGRESS,))

    def put_progress(self, progress: Any) -> None:
        """Send the progress of a long step, or None: a heartbeat."""
        self._put(PROGRESS, progress)

    def put_error(self, text: str) -> None:
        """Send why the simulation ends, and wait until that is sent."""
        self._put(ERROR, text, (PROGRESS,))
        with self._changed:
            self._changed.wait_for(lambda: not self._waiting and not self._sending)

    def _put(self, kind: bytes, content: Any, replaced: tuple[bytes, ...] = ()) -> None:
        data = packed(kind, content)
        with self._changed:
            for older in replaced:
                self._waiting.pop(older, None)
            self._waiting[kind] = data
            self._changed.notify_all()

    def _send_all(self) -> None:
        while True:
            with self._changed:
                self._sending = False
                self._changed.notify_all()
                self._changed.wait_for(lambda: self._waiting)
                self._sending = True
                kind = min(self._waiting, key=_ORDER.index)
                data = self._waiting.pop(kind)
            try:
                self._pipe.send_bytes(data)
            except OSError:  # the page is gone; the reader of commands ends this process
                return
