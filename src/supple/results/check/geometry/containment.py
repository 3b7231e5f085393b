"""Whether a point is inside a closed surface: the number of times that a way out of it crosses the surface, exactly."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.results.check.geometry.orientation import volume_sign
from supple.runtime.kernel_cache import njit

_MOST_TRIES = 64


@njit(cache=True)
def _crossings(x, p, q, triangles, rows):
    """How many triangles the segment from point p to point q crosses; -1 where it meets a side or a corner of one.

    p may lie in the plane of a triangle, but not in a triangle.
    """
    count = 0
    for row in rows:
        a, b, c = triangles[row]
        at_p, at_q = volume_sign(x, a, b, c, p), volume_sign(x, a, b, c, q)
        if at_p == 0 and at_q == 0:
            return -1
        if at_p == 0 or at_q == 0 or at_p == at_q:
            continue
        first, second, third = volume_sign(x, p, q, a, b), volume_sign(x, p, q, b, c), volume_sign(x, p, q, c, a)
        lowest, highest = min(first, second, third), max(first, second, third)
        if lowest < 0 and highest > 0:
            continue
        if lowest == 0 or highest == 0:
            return -1
        count += 1
    return count


def is_inside(
    x: NDArray[np.float64], point: NDArray[np.float64], triangles: NDArray[np.int64], rows: NDArray[np.int64]
) -> bool:
    """Whether a point (3,) lies inside the closed surface made of some `rows` of triangles (t, 3).

    The last two rows of x (n, 3) are overwritten. A point on the surface is on either side.
    """
    corners = x[triangles[rows]]
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    if (point < low).any() or (point > high).any():
        return False
    p, q = len(x) - 2, len(x) - 1
    x[p] = point
    directions = np.random.default_rng(0)
    for _ in range(_MOST_TRIES):
        direction = directions.normal(size=3)
        # Ends outside of the box: farther along one axis than the box is wide.
        x[q] = point + direction * (2.0 * float((high - low).max()) / float(np.abs(direction).max()))
        count = _crossings(x, p, q, triangles, rows)
        if count >= 0:
            return count % 2 == 1
    return False
