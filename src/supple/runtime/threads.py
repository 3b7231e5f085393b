"""How many threads a parallel kernel may use: one where the work is too small to be divided."""

from __future__ import annotations

import os
import threading
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


def one_thread() -> AbstractContextManager[None]:
    """Run Numba's parallel kernels on one thread in the form for several, see `ParallelKernel`."""
    return _UNCHANGED if is_alone() else _Threads(1, several=True)


def numba_threads(count: int | None) -> AbstractContextManager[None]:
    """Run Numba's parallel kernels on `count` threads; None leaves the number as it is.

    Where one thread is set already it costs less than a microsecond: Numba's own question for the number takes a lock
    of processes, and longer than a small kernel.
    """
    return _UNCHANGED if count is None or (count == 1 and is_alone()) else _Threads(count, count > 1)


def is_alone() -> bool:
    """Whether the calling thread has set its number of threads to one by `threads_for` or `numba_threads`."""
    return _present.several is False


def has_several() -> bool:
    """Whether the calling thread may use parallel forms."""
    return numba.get_num_threads() > 1 if _present.several is None else _present.several


class _Present(threading.local):
    several: bool | None = None  # None where nothing was set


_present = _Present()
_UNCHANGED = nullcontext()


class _Threads(AbstractContextManager[None]):
    def __init__(self, count: int, several: bool) -> None:
        self.count, self.several = count, several

    def __enter__(self) -> None:
        self.before, self.several_before = numba.get_num_threads(), _present.several
        if self.count != self.before:
            numba.set_num_threads(self.count)
        _present.several = self.several

    def __exit__(self, *error: object) -> None:
        _present.several = self.several_before
        if self.count != self.before:
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
