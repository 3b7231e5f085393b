"""Vertices of surfaces whose triangles do not meet each other, except in what they share.

Seen along a direction N, the triangles at a vertex are sectors. They are apart from each other where all of them face
N, they close around the vertex, and one of them alone covers some direction in the plane: then each direction is
covered once. Every condition has a margin for round-off; a vertex that misses it counts as not simple.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# The least cosine of the angle between a triangle and N; the sine of the angle to a sector at which it may be covered.
_FACING, _MARGIN = 1e-6, 1e-6


def _codes(count: int) -> NDArray[np.uint64]:
    """64 bits that differ from number to number without order (splitmix64; Steele, Lea, Flood 2014)."""
    z = np.arange(count, dtype=np.uint64) + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


def _dot(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.einsum("ij,ij->i", a, b)


@np.errstate(invalid="ignore", over="ignore")
def simple_stars(x: NDArray[np.float64], triangles: NDArray[np.int32]) -> NDArray[np.bool_]:
    """(n,) whether the triangles (t, 3) at each vertex x (n, 3) are apart from each other, but for what they share."""
    count = len(x)
    at, after, last = (np.roll(triangles, -k, axis=1).ravel() for k in range(3))
    codes = _codes(count)
    # Each end of the surface at the vertex would remain.
    ends = np.zeros(count, dtype=np.uint64)
    np.add.at(ends, at, codes[after] - codes[last])
    u, v = x[after] - x[at], x[last] - x[at]
    n = np.repeat(np.cross(u[::3], v[::3]), 3, axis=0)
    N = np.stack([np.bincount(at, weights=part, minlength=count) for part in n.T], axis=1, dtype=float)[at]
    # The middle of the sector of one triangle, the last one.
    rays = np.zeros((count, 3))
    rays[at] = 0.5 * (u + v)
    ray, size = rays[at], _dot(N, N)
    # Whether each sector turns by less than half a turn about N, and may cover the ray; only parts normal to N count.
    facing = _dot(n, N) > _FACING * np.sqrt(_dot(n, n) * size)
    least = -_MARGIN * np.sqrt(size * _dot(ray, ray))
    covers = _dot(N, np.cross(u, ray)) >= least * np.sqrt(_dot(u, u))
    covers &= _dot(N, np.cross(ray, v)) >= least * np.sqrt(_dot(v, v))
    covered = np.bincount(at, weights=np.where(facing, covers, 2), minlength=count)
    return (ends == 0) & (covered == 1)
