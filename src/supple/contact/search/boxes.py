"""Bounding boxes of the pieces of surfaces."""

import numpy as np

from supple.runtime.kernel_cache import njit


@njit(cache=True)
def boxes_of_pieces(points, point_piece, pad, low, high):
    """Bounds low, high (p, 3) of each piece's points, each point enlarged by its first entry in pad (n, 3)."""
    low[:] = np.inf
    high[:] = -np.inf
    for i in range(len(points)):
        k = point_piece[i]
        for j in range(3):
            low[k, j] = min(low[k, j], points[i, j] - pad[i, 0])
            high[k, j] = max(high[k, j], points[i, j] + pad[i, 0])
