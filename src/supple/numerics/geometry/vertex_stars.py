"""Vertices of surfaces whose triangles do not meet each other, except in what they share.

Seen along a direction N, the triangles at a vertex are sectors. They are apart from each other where all of them face
N, they close around the vertex, and one of them alone covers some direction in the plane: then each direction is
covered once. Every condition has a margin for round-off; a vertex that misses it counts as not simple.
"""

import numpy as np

from supple.numerics.mat3 import cross, dot, row, subtract
from supple.runtime.kernel_cache import njit

# The least cosine of the angle between a triangle and N; the sine of the angle to a sector at which it may be covered.
_FACING, _MARGIN = 1e-6, 1e-6


@njit
def _code(i):
    """64 bits that differ from number to number without order (splitmix64; Steele, Lea, Flood 2014)."""
    z = np.uint64(i) + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@njit
def _may_cover(u, v, n, ray):
    """Whether the sector from u to v, which turns by less than half a turn about n, may cover a ray.

    u, v and the ray need not be normal to n: only their parts that are count.
    """
    size = dot(n, n)
    least = -_MARGIN * np.sqrt(size * dot(ray, ray))
    after = dot(n, cross(u, ray)) >= least * np.sqrt(dot(u, u))
    return after and dot(n, cross(ray, v)) >= least * np.sqrt(dot(v, v))


@njit(cache=True)
def simple_stars(x, triangles):
    """(n,) whether the triangles (t, 3) at each vertex x (n, 3) are apart from each other, but for what they share."""
    normals, rays = np.zeros((len(x), 3)), np.zeros((len(x), 3))
    ends, covered = np.zeros(len(x), dtype=np.int64), np.zeros(len(x), dtype=np.int64)
    for t in range(len(triangles)):
        a = row(x, triangles[t, 0])
        n = cross(subtract(row(x, triangles[t, 1]), a), subtract(row(x, triangles[t, 2]), a))
        for k in range(3):
            i, j, q = triangles[t, k], triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3]
            # Each end of the surface at the vertex would remain.
            ends[i] += np.int64(_code(j) - _code(q))
            for c in range(3):
                normals[i, c] += n[c]
                # The middle of the sector of one triangle, the last one.
                rays[i, c] = 0.5 * (x[j, c] + x[q, c]) - x[i, c]
    for t in range(len(triangles)):
        a = row(x, triangles[t, 0])
        n = cross(subtract(row(x, triangles[t, 1]), a), subtract(row(x, triangles[t, 2]), a))
        for k in range(3):
            i = triangles[t, k]
            N, p = row(normals, i), row(x, i)
            u, v = subtract(row(x, triangles[t, (k + 1) % 3]), p), subtract(row(x, triangles[t, (k + 2) % 3]), p)
            facing = dot(n, N) > _FACING * np.sqrt(dot(n, n) * dot(N, N))
            covered[i] += _may_cover(u, v, N, row(rays, i)) if facing else 2
    simple = np.empty(len(x), dtype=np.bool_)
    for i in range(len(x)):
        simple[i] = ends[i] == 0 and covered[i] == 1
    return simple
