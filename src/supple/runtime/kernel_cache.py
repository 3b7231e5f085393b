"""`njit` as of Numba, with a cache that is keyed by content.

Numba names a cached kernel by its file and line, and compares it with the text and the time of that file. Here the name
is a digest of the code of everything that the kernel reaches, in any file, and of nothing else: another checkout, a
moved file or an edited comment compiles nothing, and a changed function compiles the kernels that call it.
"""

from __future__ import annotations

import ast
import hashlib
import inspect
import logging
import pickle
import sys
from contextlib import suppress
from functools import cache, cached_property, partial
from pathlib import Path
from types import FunctionType
from typing import Any

import llvmlite
import numba
import numpy as np
from numba import prange
from numba.core import config
from numba.core.caching import NullCache, _Cache
from numba.core.compiler import CompileResult
from numba.core.dispatcher import Dispatcher
from numba.core.runtime.nrt import rtsys
from numba.core.serialize import dumps
from numba.np.numpy_support import numpy_version
from numpy.typing import NDArray

from supple.runtime import inner_function, kernel_folder
from supple.runtime.displayed import WATCHERS, supplied
from supple.runtime.inner_function import InnerFunction, KernelCompiler, inlined_size
from supple.runtime.lock import FileLock
from supple.runtime.parallel_kernel import ParallelKernel
from supple.runtime.reached_code import reached_code

# Below this many rows, a loop ends before a second thread has started.
ROWS = 500
# Bytes of bytecode, with those of inlined calls, up to which an inner function is always inlined. A call that remains
# passes the arrays of a tuple one by one and counts their references: a sweep over rows of contacts takes four times as
# long. Functions with exact sums have `forceinline=False`: their code is long, and exact tests of triangles would take
# minutes to compile.
INLINED = 4_000
# What decides on machine code besides the kernel, its signature and the processor.
_SETTINGS = ("OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "BOUNDSCHECK", "USING_SVML")
_COMPILER = (
    numba.__version__,
    llvmlite.__version__,
    numpy_version,
    sys.implementation.cache_tag,
    sys.abiflags if hasattr(sys, "abiflags") else "",
    [getattr(config, name, None) for name in _SETTINGS],
    ast.dump(ast.parse(Path(inner_function.__file__).read_bytes())),  # without comments, wherever its lines are
)

logger = logging.getLogger(__name__)
KERNELS: dict[str, Dispatcher] = {}  # all kernels that are kept on disk, by name

__all__ = ["KERNELS", "KernelCache", "kernel_with", "njit", "prange", "read_only"]


def njit(
    function: FunctionType | None = None,
    *,
    cache: bool = False,
    parallel: bool = False,
    rows: int = ROWS,
    **options: Any,
) -> Any:
    """Compile a function in Numba's nopython mode: `numba.njit`, with the cache of this module.

    A kernel runs without Python's global lock, so that threads of one process can simulate at the same time. It must
    not be called by two threads with the same arrays.

    Parameters
    ----------
    cache : whether the machine code is kept on disk, see `KernelCache`.
    parallel : whether loops over `prange` may use several threads. The kernel is then a `ParallelKernel`, as is every
        kernel that calls one.
    rows : the least number of rows of an array among the arguments for several threads, where it is `parallel`; zero
        where the caller decides, by `threads_for` or `ThreadTuner`.
    options : as of `numba.njit`; `nogil=False` for a kernel with parts in Python.
    """
    if function is None:
        return partial(njit, cache=cache, parallel=parallel, rows=rows, **options)
    if not parallel and not _called_kernels(function):
        return _compiled(function, cache, options)
    serial = _compiled(_form(function, "serial"), cache, options)
    several = _compiled(_form(function, "parallel"), cache, {**options, "parallel": True} if parallel else options)
    # Where NUMBA_DISABLE_JIT is set, both are plain functions.
    return ParallelKernel(function, serial, several, rows) if isinstance(several, Dispatcher) else several


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    """The array in C order, without leave to write: a kernel that gets arrays with and without it is compiled twice."""
    view = np.ascontiguousarray(array).view()
    view.flags.writeable = False
    return view


def _compiled(function: FunctionType, cache: bool, options: dict[str, Any]) -> Any:
    # Nothing calls a kernel from C; without that wrapper, compilation takes some 6 % less time.
    options = {"nogil": True, "no_cfunc_wrapper": True, "error_model": "numpy", **options}
    if config.DISABLE_JIT:  # pyright: ignore[reportAttributeAccessIssue]
        return function
    if "__signature__" not in vars(function):  # Numba asks for it twice, which is half the time to make a kernel
        vars(function)["__signature__"] = inspect.signature(function)
    if not cache:
        options = {**options, "nopython": True, "boundscheck": None}
        return InnerFunction(function, {}, {"forceinline": inlined_size(function) <= INLINED, **options})
    compiled: Any = numba.njit(**options, pipeline_class=KernelCompiler)(function)
    compiled._cache = kept = KernelCache(compiled)
    KERNELS[kept.name] = compiled
    return compiled


def _called_kernels(function: FunctionType) -> dict[str, ParallelKernel]:
    """The parallel kernels that a function calls, by the names that they have in its file; they stand above it."""
    known = ((name, function.__globals__.get(name)) for name in function.__code__.co_names)
    return {name: value for name, value in known if isinstance(value, ParallelKernel)}


def _form(function: FunctionType, form: str) -> FunctionType:
    """A copy of a function that calls the same form of other kernels: "serial" or "parallel".

    It has a different name: Numba's cache distinguishes kernels by name, not by options.
    """
    called = {name: getattr(kernel, form) for name, kernel in _called_kernels(function).items()}
    names = {**function.__globals__, **called} if called else function.__globals__
    copy = FunctionType(
        function.__code__, names, f"{function.__name__}_{form}", function.__defaults__, function.__closure__
    )
    copy.__qualname__, copy.__module__ = f"{function.__qualname__}_{form}", function.__module__
    copy.__doc__ = function.__doc__
    return copy


def kernel_with(kernel: FunctionType, name: str, **names: Any) -> FunctionType:
    """A copy of a kernel in which some global names have other values.

    Parameters
    ----------
    name : of the copy, after the kernel's own. Numba's cache and the linker of cached kernels distinguish functions by
        their names only.
    """
    copy = FunctionType(kernel.__code__, {**kernel.__globals__, **names}, kernel.__name__, kernel.__defaults__)
    copy.__qualname__ = f"{kernel.__qualname__}.{name}"
    copy.__module__ = kernel.__module__
    return copy


class KernelCache(_Cache):
    """The compiled forms of one kernel on disk, see `supple.runtime.kernel_folder`.

    Of several processes that need the kernel at once, as those of a study do, one compiles it and the others wait.
    """

    def __init__(self, kernel: Dispatcher) -> None:
        self._kernel = kernel
        self._locks: dict[Path, FileLock] = {}

    @property
    def cache_path(self) -> str:
        return str(kernel_folder.kernel_folder())

    def enable(self) -> None:
        """It is always enabled."""

    def disable(self) -> None:
        """From now on, the kernel is compiled in each process."""
        self._kernel._cache = NullCache()  # pyright: ignore[reportAttributeAccessIssue]

    def flush(self) -> None:
        """Nothing is out of date: an entry is named by all that it depends on."""

    @property
    def name(self) -> str:
        return f"{self._kernel.py_func.__module__}:{self._kernel.py_func.__qualname__}"

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        # Numba's own cache also imports all that a compilation needs: a tenth of the time to a first frame.
        rtsys.initialize(target_context)
        compiled = None
        if kernel_folder.shipped_target() is not None:
            shipped = self._entry(sig, kernel_folder.shipped_target())
            compiled = _rebuilt(kernel_folder.read(kernel_folder.SHIPPED / shipped), target_context)
        path = kernel_folder.kernel_folder() / self._entry(sig, target_context.codegen().magic_tuple())
        if compiled is None:
            compiled = self._own(path, target_context)
        self._tell("compiling" if compiled is None else "loaded", sig)
        return compiled

    def _own(self, path: Path, target_context: Any) -> Any:
        """The kernel from the user's folder; None where it must be compiled here, and is locked for that."""
        compiled = _rebuilt(kernel_folder.read(path), target_context)
        if compiled is None and path not in self._locks:
            lock, waited = kernel_folder.lock(path)
            if lock is not None:
                self._locks[path] = lock
            compiled = _rebuilt(kernel_folder.read(path), target_context) if waited else None
            if compiled is not None:
                self._unlock(path)
        if compiled is not None:
            kernel_folder.note_use(path)
        return compiled

    def save_overload(self, sig: Any, data: Any) -> None:
        path = kernel_folder.kernel_folder() / self._entry(sig, data.codegen.magic_tuple())
        # A kernel that is not kept is compiled again next time: a full disk does not end a run.
        with suppress(OSError):
            if not data.library.has_dynamic_globals:  # addresses of this process
                kernel_folder.write(path, dumps(data._reduce()))
        self._unlock(path)
        self._tell("compiled", sig)

    def _tell(self, stage: str, sig: Any) -> None:
        _watch()
        if stage == "compiling":
            _announce()
            logger.debug("compiling %s", self.name)
        for watcher in WATCHERS:
            watcher(stage, self.name, sig)

    def _unlock(self, path: Path) -> None:
        lock = self._locks.pop(path, None)
        if lock is not None:
            lock.release()

    def _entry(self, sig: Any, target: Any) -> str:
        """The name of a file. An entry refers to the module of its kernel, and its symbols to the name."""
        text = repr((_COMPILER, tuple(target), self.name, str(sig), self._code))
        return f"{hashlib.sha256(text.encode()).hexdigest()[:40]}.kernel"

    @cached_property
    def _code(self) -> bytes:
        # A kernel may call what is defined below it, so that the digest waits for the first call.
        return reached_code(self._kernel)


@cache  # once per process
def _watch() -> None:
    supplied("compilation")()


@cache
def _announce() -> None:
    logger.info("compiling kernels, once on this machine; `supple warm` does so beforehand")


def _rebuilt(content: bytes | None, target_context: Any) -> Any:
    if content is None:
        return None
    try:
        return CompileResult._rebuild(target_context, *pickle.loads(content))
    except Exception:  # it names something that has moved since; unpickling may raise anything
        return None
