"""How many threads a parallel kernel may use: one where the work is too small to be divided."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numba


@contextmanager
def threads_for(work: int, least: int) -> Iterator[None]:
    """Run Numba's parallel kernels on one thread where `work` is below `least`.

    A small pass takes a fraction of a millisecond. Where another process uses the second core, waiting for a thread
    there takes many times longer. Kernels here give the same bits on any number of threads.
    """
    with one_thread(work < least):
        yield


@contextmanager
def one_thread(alone: bool) -> Iterator[None]:
    """Run Numba's parallel kernels on one thread if `alone`."""
    if not alone:
        yield
        return
    before = numba.get_num_threads()
    numba.set_num_threads(1)
    try:
        yield
    finally:
        numba.set_num_threads(before)
