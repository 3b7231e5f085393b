"""How many threads a parallel kernel may use: one where the work is too small to be divided."""

from __future__ import annotations

import os
from contextlib import AbstractContextManager, nullcontext
from typing import Any

import numba
from numba.np.ufunc import parallel


def threads_for(work: int, least: int) -> AbstractContextManager[None]:
    """Run Numba's parallel kernels on one thread where `work` is below `least`.

    A small pass takes a fraction of a millisecond. Where another process uses the second core, waiting for a thread
    there takes many times longer. Kernels here give the same bits on any number of threads.
    """
    return numba_threads(1 if work < least else None)


def one_thread(alone: bool) -> AbstractContextManager[None]:
    """Run Numba's parallel kernels on one thread if `alone`."""
    return numba_threads(1 if alone else None)


def numba_threads(count: int | None) -> AbstractContextManager[None]:
    """Run Numba's parallel kernels on `count` threads; None leaves the number as it is.

    Within another one of the same number it costs less than a microsecond: Numba's own call takes longer than a small
    kernel.
    """
    return _UNCHANGED if count is None or count == numba.get_num_threads() else _Threads(count)


_UNCHANGED = nullcontext()


class _Threads(AbstractContextManager[None]):
    def __init__(self, count: int) -> None:
        self.count, self.before = count, 0

    def __enter__(self) -> None:
        self.before = numba.get_num_threads()
        numba.set_num_threads(self.count)

    def __exit__(self, *error: object) -> None:
        numba.set_num_threads(self.before)


def _forget_the_inherited_lock() -> None:
    """In a forked process: Numba takes this lock at every question for the number of threads.

    It is one of processes, so that it would stay locked for the parent and for its other children where this process
    is killed while it holds it. Numba makes another one.
    """
    module: Any = parallel
    module._backend_init_process_lock = None


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_the_inherited_lock)
