"""How many threads a parallel kernel may use: one where the work is too small to be divided."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager

import numba


def threads_for(work: int, least: int) -> AbstractContextManager[None]:
    """Run Numba's parallel kernels on one thread where `work` is below `least`.

    A small pass takes a fraction of a millisecond. Where another process uses the second core, waiting for a thread
    there takes many times longer. Kernels here give the same bits on any number of threads.
    """
    return numba_threads(1 if work < least else None)


def one_thread(alone: bool) -> AbstractContextManager[None]:
    """Run Numba's parallel kernels on one thread if `alone`."""
    return numba_threads(1 if alone else None)


@contextmanager
def numba_threads(count: int | None) -> Iterator[None]:
    """Run Numba's parallel kernels on `count` threads; None leaves the number as it is."""
    if count is None:
        yield
        return
    before = numba.get_num_threads()
    numba.set_num_threads(count)
    try:
        yield
    finally:
        numba.set_num_threads(before)
