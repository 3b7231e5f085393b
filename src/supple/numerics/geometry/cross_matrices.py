"""Cross products as matrices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def cross_matrices(v: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k, 3, 3) the matrices of w -> v x w for v (k, 3)."""
    out = np.zeros((len(v), 3, 3))
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    out[:, 1, 0], out[:, 2, 0], out[:, 2, 1] = v[:, 2], -v[:, 1], v[:, 0]
    return out
