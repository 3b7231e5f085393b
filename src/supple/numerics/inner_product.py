"""The inner product of all entries, added on one thread.

BLAS (`np.vdot`, `np.linalg.norm`) shares vectors of more than 10,000 entries between threads of its own: their order of
summation depends on the number of cores, and where other work runs on those, a product of 10 us takes 5 ms.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray


def inner(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """sum_ij a_ij b_ij of two (n, 3)."""
    return float(np.einsum("ij,ij->", a, b))


def norm(a: NDArray[np.float64]) -> float:
    """The root of the sum of squares of all entries (n, 3)."""
    return math.sqrt(inner(a, a))
