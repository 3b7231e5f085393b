"""Kernels over `prange` that run on several threads where this is possible, and otherwise on the calling thread."""

from __future__ import annotations

import os
import threading
from functools import update_wrapper
from types import FunctionType
from typing import Any

import numpy as np
from numba.core.dispatcher import Dispatcher
from numba.np.ufunc.parallel import threading_layer

from supple.runtime.threads import has_several


class ParallelKernel:
    """Two compiled forms of one loop, with the same bits. A call takes the one that is right at that moment.

    The parallel form is not used

    - where one thread is allowed from outside, by `numba_threads` or NUMBA_NUM_THREADS: a call into the threads costs
      some microseconds even then. Within `one_thread` it is used, on one thread;
    - where no argument has as many rows as pay for that. A small scene compiles no parallel form;
    - while another Python thread uses it: the layer `workqueue` of Numba ends the process that does so;
    - after a fork of a process that used GNU OpenMP: the layer `omp` ends the process.

    Parameters
    ----------
    function : in Python; serial, parallel : its two forms, each with a different name in the cache
    rows : the least number of rows of an array among the arguments for the parallel form

    Source: Numba's manual, "The Threading Layers", on safety.
    """

    def __init__(self, function: FunctionType, serial: Any, parallel: Any, rows: int) -> None:
        self.py_func, self.serial, self.parallel, self.rows = function, serial, parallel, rows
        update_wrapper(self, function)

    def __call__(self, *arguments: Any) -> Any:
        several = has_several() and not _threads.lost and _has_rows(arguments, self.rows)
        if not several or not _threads.lock.acquire(blocking=False):
            return self.serial(*arguments)
        try:
            return self.parallel(*arguments)
        finally:
            _threads.lock.release()

    @property
    def targetoptions(self) -> dict[str, Any]:
        """The compiler options of the parallel form."""
        return self.parallel.targetoptions

    @property
    def forms(self) -> tuple[Dispatcher, ...]:
        """The compiled functions; none where NUMBA_DISABLE_JIT is set."""
        return tuple(form for form in (self.serial, self.parallel) if isinstance(form, Dispatcher))


def _has_rows(arguments: tuple[Any, ...], least: int) -> bool:
    """Whether an array among some arguments, or in a tuple of them, has as many rows."""
    if least == 0:
        return True
    for value in arguments:
        if isinstance(value, np.ndarray):
            if value.ndim and len(value) >= least:
                return True
        elif isinstance(value, tuple) and _has_rows(value, least):
            return True
    return False


class _Threads:
    """Whether Numba's threads can be used by the current call."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.lost = False

    def after_fork(self) -> None:
        """The parent's threads do not exist in the child, and its lock may have been held by one of them."""
        self.lock = threading.Lock()
        try:
            self.lost = threading_layer() == "omp"
        except ValueError:  # the parent had not used any
            self.lost = False


_threads = _Threads()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_threads.after_fork)
