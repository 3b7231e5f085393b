"""Matrices between embedded points as matrices between the vertices that carry them: W^T H W."""

from __future__ import annotations

import numpy as np

from supple.numerics.geometry.embedded_points import EmbeddedPoints
from supple.numerics.sparse.couplings import Couplings
from supple.runtime.kernel_cache import njit


def vertex_couplings(points: EmbeddedPoints, between: Couplings) -> Couplings:
    """The couplings of vertices, from those `between` points."""
    if points.are_vertices:
        return Couplings(points.vertices[between.rows], points.vertices[between.columns], between.blocks)
    return Couplings(
        *_spread(between.rows, between.columns, between.blocks, points.start, points.vertices, points.weights)
    )


@njit(cache=True)
def _spread(rows, columns, blocks, start, vertices, weights):
    count = 0
    for t in range(len(rows)):
        one, other = start[rows[t] + 1] - start[rows[t]], start[columns[t] + 1] - start[columns[t]]
        count += one * (one + 1) // 2 if rows[t] == columns[t] else one * other
    new_rows, new_columns = np.empty(count, dtype=np.int32), np.empty(count, dtype=np.int32)
    out = np.empty((count, 3, 3))
    b = 0
    for t in range(len(rows)):
        for k in range(start[rows[t]], start[rows[t] + 1]):
            # Each unordered pair of the vertices of one point is given once.
            for m in range(k if rows[t] == columns[t] else start[columns[t]], start[columns[t] + 1]):
                i, j, size = vertices[k], vertices[m], weights[k] * weights[m]
                new_rows[b], new_columns[b] = i, j
                for p in range(3):
                    for q in range(3):
                        out[b, p, q] = size * blocks[t, p, q]
                        # Two points on one vertex: its block contains the pair in both orders.
                        if i == j and (rows[t] != columns[t] or k != m):
                            out[b, p, q] += size * blocks[t, q, p]
                b += 1
    return new_rows, new_columns, out
