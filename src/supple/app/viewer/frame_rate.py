"""Frame rate of the page: as high as server and browsers allow."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from statistics import median
from typing import Any

FASTEST, SLOWEST = 1.0 / 60.0, 0.5  # between two pictures [s]
_SHARE = 0.5  # largest share of the time for drawing
# The cost of a picture is the median of the latest ones: a single late one must not delay those after it.
_SAMPLES = 3


class FrameRate:
    """No queue builds up: a picture is sent only after the server has processed the previous one.

    For each visitor, viser keeps the newest value of every drawn property, and sends it when this visitor has received
    the previous one. A slow visitor skips pictures without effect on others. Only the loop of the server, which serves
    all visitors, can fall behind: then fewer pictures are sent.
    """

    def __init__(self, server: Any) -> None:
        self._loop = server.get_event_loop()
        self._asked = self._answered = 0.0
        self._costs = deque([0.0] * _SAMPLES, maxlen=_SAMPLES)
        self._next = 0.0

    def pause(self) -> float:
        """Time to wait before the next check [s]."""
        return max(0.001, min(self._next - time.monotonic(), SLOWEST))

    def may_send(self) -> bool:
        """Whether the server has processed the last picture."""
        return self._answered >= self._asked

    @property
    def interval(self) -> float:
        """Current time between two pictures [s]."""
        return min(SLOWEST, max(FASTEST, median(self._costs) / _SHARE))

    @contextmanager
    def sending(self) -> Iterator[None]:
        """A block that draws one picture. One that raises does not stop the pictures after it."""
        began = time.monotonic()
        self._asked = began
        try:
            yield
        finally:
            drawn = time.monotonic() - began
            try:
                self._loop.call_soon_threadsafe(self._processed, began, drawn)
            except RuntimeError:  # the server has stopped
                self._answered = self._asked
            self._next = began + self.interval

    def _processed(self, asked: float, drawn: float) -> None:
        """Called in the loop of the server after the picture has been processed."""
        lag = time.monotonic() - asked - drawn
        self._costs.append(drawn + max(0.0, lag))
        self._answered = asked
