"""How kernels are compiled: what the compiler may do to sums, and one loop for one thread and for several."""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any, NamedTuple

from supple.numerics.kernel_cache import njit

# No flag that assumes finite numbers (NaN must be seen) and none that reorders sums (same bits for any thread count).
FLAGS = {"contract", "arcp", "nsz"}


class SerialAndParallel(NamedTuple):
    """The two kernels of a loop, by whether they may use several threads: `sweep[parallel](...)`."""

    serial: Callable[..., Any]
    parallel: Callable[..., Any]


def serial_and_parallel(loop: FunctionType) -> SerialAndParallel:
    """Compile a loop over `prange` for one thread and for several.

    A parallel kernel costs some microseconds even on one thread, which is as much as a whole sweep of a small scene.
    The copy has a name of its own because Numba's cache tells kernels apart by name, not by their flags.
    """
    copy = FunctionType(loop.__code__, loop.__globals__, f"{loop.__name__}_parallel", loop.__defaults__)
    copy.__qualname__ = f"{loop.__qualname__}_parallel"
    copy.__module__ = loop.__module__
    return SerialAndParallel(njit(cache=True)(loop), njit(cache=True, parallel=True)(copy))
