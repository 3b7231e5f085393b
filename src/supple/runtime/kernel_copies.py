"""Copies of kernels in which names stand for something else: one loop for several laws."""

from __future__ import annotations

from types import FunctionType
from typing import Any


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
