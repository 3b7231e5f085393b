"""How many threads a parallel kernel may use: one where the work is too small to be divided."""

from __future__ import annotations

import os
import threading
from contextlib import AbstractContextManager, nullcontext
from functools import cache
from typing import Any

import numba
from numba.core import config
from numba.np.ufunc import parallel

# A call into OpenMP takes 2 us; into TBB, Numba's own first choice, 270 us, and its threads shared no loop of a step.
_LAYERS = ["omp", "tbb", "workqueue"]
# Turns of a loop, some .15 ms, for which threads of GNU OpenMP wait busily for the next kernel. By itself it waits for
# milliseconds: where other processes are busy, a step then took up to 20 times as much of the processor.
_SPINS = "10000"


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
    of processes, and longer than a small kernel. Where several threads run, OpenBLAS has one.
    """
    if count is None:
        return _one_blas_thread if has_several() else _UNCHANGED
    return _UNCHANGED if count == 1 and is_alone() else _Threads(count, count > 1)


def is_alone() -> bool:
    """Whether the calling thread has set its number of threads to one by `threads_for` or `numba_threads`."""
    return _present.several is False


def has_several() -> bool:
    """Whether the calling thread may use parallel forms."""
    return numba.get_num_threads() > 1 if _present.several is None else _present.several


class _Present(threading.local):
    several: bool | None = None  # None where nothing was set


_present = _Present()
if "NUMBA_THREADING_LAYER_PRIORITY" not in os.environ:
    config.THREADING_LAYER_PRIORITY = _LAYERS  # pyright: ignore[reportAttributeAccessIssue]
if not {"GOMP_SPINCOUNT", "OMP_WAIT_POLICY"} & os.environ.keys():
    os.environ["GOMP_SPINCOUNT"] = _SPINS  # GNU OpenMP reads it where it is loaded, with the first parallel kernel
_UNCHANGED = nullcontext()


class _Threads(AbstractContextManager[None]):
    def __init__(self, count: int, several: bool) -> None:
        self.count, self.several = count, several

    def __enter__(self) -> None:
        self.before, self.several_before = numba.get_num_threads(), _present.several
        if self.count != self.before:
            numba.set_num_threads(self.count)
        _present.several = self.several
        if self.count > 1:
            _one_blas_thread.__enter__()

    def __exit__(self, *error: object) -> None:
        if self.count > 1:
            _one_blas_thread.__exit__()
        _present.several = self.several_before
        if self.count != self.before:
            numba.set_num_threads(self.before)


class _OneBlasThread(AbstractContextManager[None]):
    """Within its block, in all Python threads of the process, OpenBLAS uses the thread that calls it.

    OpenBLAS takes several for a dot product of 10,000 numbers. Each of them then waits busily for about 50 ms for more
    work, on a core that Numba's threads need: with two cores, loops that two threads share gain nothing. The number of
    threads is that of the process. It is set where the first block begins, and restored where the last one ends.
    """

    def __init__(self) -> None:
        self._lock, self._blocks = threading.Lock(), 0

    def __enter__(self) -> None:
        with self._lock:
            if self._blocks == 0:
                self._limit = _openblas().limit(limits=1)
            self._blocks += 1

    def __exit__(self, *error: object) -> None:
        with self._lock:
            self._blocks -= 1
            if self._blocks == 0:
                self._limit.restore_original_limits()

    def after_fork(self) -> None:
        """The lock may have been held by a thread of the parent, which does not exist in the child."""
        self._lock = threading.Lock()


@cache
def _openblas() -> Any:
    """The copies of OpenBLAS that NumPy and SciPy have loaded; reading their list takes 3 ms."""
    from threadpoolctl import ThreadpoolController  # takes milliseconds, which small scenes do not need

    return ThreadpoolController().select(internal_api="openblas")


_one_blas_thread = _OneBlasThread()


def _forget_the_inherited_lock() -> None:
    """In a forked process: Numba takes this lock at every question for the number of threads.

    It is one of processes, so that it would stay locked for the parent and for its other children where this process
    is killed while it holds it. Numba makes another one.
    """
    module: Any = parallel
    module._backend_init_process_lock = None


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_the_inherited_lock)
    os.register_at_fork(after_in_child=_one_blas_thread.after_fork)
