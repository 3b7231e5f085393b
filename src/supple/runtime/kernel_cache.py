"""`njit` as of Numba, with a cache that is renewed when a function that the kernel calls has changed, in any file.

Numba compares a cached kernel with the text of the file that the kernel stands in. It does not look at the functions
that the kernel calls: when one of them changes in another file, Numba loads the old machine code. Here the index of
the cache also holds a digest of the code of everything that the kernel reaches.
"""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Iterator
from contextlib import suppress
from functools import cached_property, partial
from pathlib import Path
from time import monotonic, sleep
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numba
import numpy as np
from numba import prange
from numba.core.caching import FunctionCache
from numba.core.dispatcher import Dispatcher
from numba.core.registry import CPUDispatcher
from numpy.typing import NDArray

from supple.runtime.lock import FileLock
from supple.runtime.parallel_kernel import ParallelKernel

# How long a process waits for another one that compiles the same kernel, and how long between two looks [s].
_LONGEST_WAIT, _PAUSE = 60.0, 0.02

__all__ = ["KernelCache", "njit", "prange", "reached_code", "read_only"]


def njit(function: FunctionType | None = None, *, cache: bool = False, parallel: bool = False, **options: Any) -> Any:
    """Compile a function in Numba's nopython mode: `numba.njit`, with the cache of this module.

    A kernel runs without Python's global lock, so that threads of one process can simulate at the same time. It must
    not be called by two threads with the same arrays.

    Parameters
    ----------
    cache : whether the machine code is kept on disk, see `KernelCache`.
    parallel : whether loops over `prange` may use several threads. The kernel is then a `ParallelKernel`, as is every
        kernel that calls one.
    options : as of `numba.njit`; `nogil=False` for a kernel with parts in Python.
    """
    if function is None:
        return partial(njit, cache=cache, parallel=parallel, **options)
    if not parallel and not _called_kernels(function):
        return _compiled(function, cache, options)
    serial = _compiled(_form(function, "serial"), cache, options)
    several = _compiled(_form(function, "parallel"), cache, {**options, "parallel": True} if parallel else options)
    # Where NUMBA_DISABLE_JIT is set, both are plain functions.
    return ParallelKernel(function, serial, several) if isinstance(several, Dispatcher) else several


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    """The array in C order, without leave to write: a kernel that gets arrays with and without it is compiled twice."""
    view = np.ascontiguousarray(array).view()
    view.flags.writeable = False
    return view


def _compiled(function: FunctionType, cache: bool, options: dict[str, Any]) -> Any:
    # Nothing calls a kernel from C; without that wrapper, compilation takes some 6 % less time.
    options = {"nogil": True, "no_cfunc_wrapper": True, **options}
    compiled: Any = numba.njit(**options)(function)
    if not isinstance(compiled, Dispatcher):  # NUMBA_DISABLE_JIT is set
        return compiled
    if cache:
        compiled._cache = KernelCache(function)  # pyright: ignore[reportAttributeAccessIssue]
        return compiled
    return InnerFunction(function, {}, compiled.targetoptions)


class InnerFunction(CPUDispatcher):
    """A function that kernels call. It is compiled without a wrapper for calls from Python, in some 8 % less time.

    Called from Python, as in tests, it is compiled once more, with the wrapper.
    """

    def __init__(self, py_func: FunctionType, locals: dict[str, Any], targetoptions: dict[str, Any]) -> None:
        super().__init__(py_func, locals, {**targetoptions, "no_cpython_wrapper": True})

    def __call__(self, *values: Any) -> Any:
        return self._from_python(*values)

    @cached_property
    def _from_python(self) -> Any:
        options: dict[str, Any] = {**self.targetoptions, "no_cpython_wrapper": False}
        return numba.jit(**options)(self.py_func)


def _called_kernels(function: FunctionType) -> dict[str, ParallelKernel]:
    """The parallel kernels that a function calls, by the names that they have in its file; they stand above it."""
    known = ((name, function.__globals__.get(name)) for name in function.__code__.co_names)
    return {name: value for name, value in known if isinstance(value, ParallelKernel)}


def _form(function: FunctionType, form: str) -> FunctionType:
    """A copy of a function that calls the same form of other kernels: "serial" or "parallel".

    It has a name of its own: Numba's cache distinguishes kernels by name, not by options.
    """
    called = {name: getattr(kernel, form) for name, kernel in _called_kernels(function).items()}
    names = {**function.__globals__, **called} if called else function.__globals__
    copy = FunctionType(
        function.__code__, names, f"{function.__name__}_{form}", function.__defaults__, function.__closure__
    )
    copy.__qualname__, copy.__module__ = f"{function.__qualname__}_{form}", function.__module__
    copy.__doc__ = function.__doc__
    return copy


class KernelCache(FunctionCache):
    """Numba's cache of one kernel, with the code that the kernel reaches in its stamp.

    The code is that in memory, not that of the files: a file that is edited after its import cannot be mistaken for
    what is compiled.

    Of several processes that need the kernel at once, as those of a study do, one compiles it and the others wait.
    """

    _lock: FileLock | None = None

    def load_overload(self, sig, target_context):
        # A kernel may call what is defined below it, so the stamp waits for the first call. Numba loads, then saves.
        self._cache_file._source_stamp = self._stamp
        found = self._loaded(sig, target_context)
        if found is None and self._lock is None and self._wait():
            found = self._loaded(sig, target_context)
            if found is not None:
                self._unlock()
        return found

    def _loaded(self, sig, target_context):
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # the files name a module that has moved since, or are damaged: unpickling may raise anything
            with suppress(OSError):
                self.flush()
            return None

    def save_overload(self, sig, data):
        # A kernel that is not kept is compiled again next time: a full disk is no reason to end a run.
        with suppress(OSError):
            super().save_overload(sig, data)
        self._unlock()

    def _wait(self) -> bool:
        """Lock the kernel, to compile it here; whether another process has had it locked until then."""
        waited, end = False, monotonic() + _LONGEST_WAIT
        with suppress(OSError):  # where nothing can be written, nothing is kept
            self._impl.locator.ensure_cache_path()
            path = Path(self._cache_path) / f"{self._cache_file._index_name}.lock"
            while (lock := FileLock.acquired(path)) is None and monotonic() < end:
                waited = True
                sleep(_PAUSE)
            self._lock = lock
        return waited

    def _unlock(self) -> None:
        if self._lock is not None:
            self._lock.release()
            self._lock = None

    @cached_property
    def _stamp(self) -> tuple[Any, bytes]:
        return self._impl.locator.get_source_stamp(), reached_code(self._py_func)


def reached_code(kernel: FunctionType) -> bytes:
    """A digest of the bytecode, constants and compiler options of a kernel and of all compiled functions it reaches."""
    digest = hashlib.sha256()
    visited: set[FunctionType] = set()
    pending: list[Any] = [kernel]
    while pending:
        value = pending.pop()
        if isinstance(value, Dispatcher):
            # Sets of options have no order of their own.
            options = {k: sorted(v) if isinstance(v, (set, frozenset)) else v for k, v in value.targetoptions.items()}
            digest.update(repr(sorted(options.items())).encode())
            value = value.py_func
        if isinstance(value, tuple):
            pending += value
        elif isinstance(value, (int, float, complex, str, bytes, np.generic, np.ndarray)):
            digest.update(pickle.dumps(value))
        elif isinstance(value, FunctionType) and value not in visited:
            visited.add(value)
            codes = list(_nested_codes(value.__code__))
            for code in codes:
                constants = [constant for constant in code.co_consts if not isinstance(constant, CodeType)]
                digest.update(repr((code.co_code, code.co_names, code.co_varnames, constants)).encode())
            pending += _used_values(value, codes)
    return digest.digest()


def _nested_codes(code: CodeType) -> Iterator[CodeType]:
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _nested_codes(constant)


def _used_values(function: FunctionType, codes: list[CodeType]) -> Iterator[Any]:
    """What the names in a function mean, in an order that every process agrees on.

    Plain functions are left out: compiled code cannot call them.
    """
    cells = (cell.cell_contents for cell in function.__closure__ or ())
    closure = dict(zip(function.__code__.co_freevars, cells, strict=True))
    names = list(dict.fromkeys([*closure, *(name for code in codes for name in code.co_names)]))
    for name in names:
        value = closure.get(name, function.__globals__.get(name))
        values = [getattr(value, member, None) for member in names] if isinstance(value, ModuleType) else [value]
        yield from (value for value in values if not isinstance(value, FunctionType))
