"""How often the page is sent something new: as often as server and browsers can take, and no more."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

FASTEST, SLOWEST = 1.0 / 60.0, 0.5  # between two pictures [s]
_SHARE = 0.5  # of the time that drawing may take


class FrameRate:
    """Nothing queues up: a picture is sent only once the server has dealt with the one before.

    viser keeps, for each visitor, the newest value of everything that is drawn, and sends it when that visitor has
    taken the one before; a slow visitor skips pictures, and holds up nobody. What is left to watch is the server's
    own loop, which serves all of them: where it lags behind, fewer pictures are sent.
    """

    def __init__(self, server: Any) -> None:
        self._loop = server.get_event_loop()
        self._asked = self._answered = 0.0
        self._cost = 0.0
        self._next = 0.0

    def pause(self) -> float:
        """How long to wait before the next look [s]."""
        return max(0.001, min(self._next - time.monotonic(), SLOWEST))

    def may_send(self) -> bool:
        """Whether the server has come around since the last picture."""
        return self._answered >= self._asked

    @property
    def interval(self) -> float:
        """Between two pictures, as things are [s]."""
        return min(SLOWEST, max(FASTEST, self._cost / _SHARE))

    @contextmanager
    def sending(self) -> Iterator[None]:
        """Around drawing one picture."""
        began = time.monotonic()
        self._asked = began
        yield
        drawn = time.monotonic() - began
        try:
            self._loop.call_soon_threadsafe(self._came_around, began, drawn)
        except RuntimeError:  # the server has stopped
            self._answered = self._asked
        self._next = began + self.interval

    def _came_around(self, asked: float, drawn: float) -> None:
        """Called in the server's loop, once it gets there."""
        lag = time.monotonic() - asked - drawn
        # Quick to slow down, slow to speed up.
        cost = drawn + max(0.0, lag)
        self._cost = cost if cost > self._cost else 0.7 * self._cost + 0.3 * cost
        self._answered = asked
