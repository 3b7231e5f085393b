"""Normals at the vertices of triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.runtime.kernel_cache import njit


def vertex_normals(x: NDArray[np.float64], triangles: NDArray[np.int32]) -> NDArray[np.float64]:
    """Unit normals (k, 3) at vertices x (k, 3): of the triangles around each, weighted by area."""
    return _normals_at(np.ascontiguousarray(x), triangles)


@njit(cache=True)
def _normals_at(x, triangles):
    """(k, 3) the direction of the sum of the area vectors of the triangles (t, 3) around each vertex x (k, 3)."""
    out = np.zeros_like(x)
    for t in range(len(triangles)):
        a, b, c = triangles[t]
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            area = (x[b, i] - x[a, i]) * (x[c, j] - x[a, j]) - (x[b, j] - x[a, j]) * (x[c, i] - x[a, i])
            out[a, k] += area
            out[b, k] += area
            out[c, k] += area
    for row in out:
        length = np.sqrt(row[0] ** 2 + row[1] ** 2 + row[2] ** 2)
        if length > 0.0:
            row /= length
        else:
            row[1] = 1.0
    return out
