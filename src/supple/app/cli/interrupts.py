"""Ctrl-C, and the request of a system to end: the first one lets the frame finish, the second one stops at once."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import Any

from supple.app.cli.console import print_error


class Interrupts:
    """Within a `with` block, the first signal sets `asked`, and the second one raises KeyboardInterrupt.

    Outside of the main thread, which Python gives all signals to, it has no effect.
    """

    def __init__(self) -> None:
        self.asked = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Interrupts:
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                self._before[number] = signal.signal(number, self._handle)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _handle(self, number: int, frame: FrameType | None) -> None:
        if self.asked:
            raise KeyboardInterrupt
        self.asked = True
        print_error("finishes the frame; Ctrl-C again stops at once")


@contextmanager
def ended_as_by_ctrl_c() -> Iterator[None]:
    """Within this block, the request of a system to end raises KeyboardInterrupt, so that what is begun is cleaned up.

    Outside of the main thread it has no effect.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(number: int, frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
