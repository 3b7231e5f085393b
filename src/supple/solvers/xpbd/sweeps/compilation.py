"""How kernels are compiled: permitted floating-point transformations, and a serial and a parallel form of a loop."""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any, NamedTuple

from supple.runtime.kernel_cache import njit

# No flag that assumes finite numbers (NaN must be detected) and none that reorders sums (same bits on any threads).
FLAGS = {"contract", "arcp", "nsz"}


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


class SerialAndParallel(NamedTuple):
    """The two kernels of a loop, selected by whether several threads may be used: `sweep[parallel](...)`."""

    serial: Callable[..., Any]
    parallel: Callable[..., Any]


def serial_and_parallel(loop: FunctionType) -> SerialAndParallel:
    """Compile a loop over `prange` for one thread and for several.

    A call of a parallel kernel costs some microseconds even on one thread, as much as a whole sweep of a small scene.
    The copy has its own name because Numba's cache distinguishes kernels by name, not by flags.
    """
    copy = FunctionType(loop.__code__, loop.__globals__, f"{loop.__name__}_parallel", loop.__defaults__)
    copy.__qualname__ = f"{loop.__qualname__}_parallel"
    copy.__module__ = loop.__module__
    return SerialAndParallel(njit(cache=True)(loop), njit(cache=True, parallel=True)(copy))
