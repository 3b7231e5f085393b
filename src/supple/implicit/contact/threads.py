"""The number of threads that the contact library may use, which is a setting of the whole process."""

from __future__ import annotations

import sys
import threading
from collections.abc import Generator
from contextlib import contextmanager

_lock = threading.Lock()
_inside = 0
_before = 0


@contextmanager
def one_contact_thread() -> Generator[None]:
    """Give the contact library one thread, and afterwards as many as before. Does nothing where it is not imported.

    With several threads the library finds contacts in an order, and rounds its sums in a way, that differs from run to
    run. With one, the same scene gives the same bits.
    """
    ipctk = sys.modules.get("ipctk")
    if ipctk is None:
        yield
        return
    global _inside, _before
    with _lock:  # simulations may run in several threads: the last one gives the library its threads back
        if _inside == 0:
            _before = ipctk.get_num_threads()
            ipctk.set_num_threads(1)
        _inside += 1
    try:
        yield
    finally:
        with _lock:
            _inside -= 1
            if _inside == 0:
                ipctk.set_num_threads(_before)
