"""Loops that are compiled for one thread and for several."""

import numpy as np
from numba import prange

from supple.solvers.xpbd.sweeps.compilation import serial_and_parallel


@serial_and_parallel
def fill(out, value):
    """Put a value everywhere."""
    for k in prange(len(out)):
        out[k] = value + k


def test_both_kernels_do_the_same_and_have_different_names():
    results = []
    for parallel in (False, True):
        out = np.zeros(1000)
        fill[parallel](out, 2.0)
        results.append(out)
    assert np.array_equal(*results)
    assert np.array_equal(results[0], 2.0 + np.arange(1000))
    # The cache distinguishes kernels by name only.
    assert [kernel.py_func.__qualname__ for kernel in fill] == ["fill", "fill_parallel"]
    assert [bool(kernel.targetoptions.get("parallel")) for kernel in fill] == [False, True]
