"""Forces and matrices of pairs, by their points: what barrier, friction and rows have in common.

A pair k acts on the vector sum_i c_i x_i. A force f on it is the force c_i f on point i, and a matrix M by it has the
blocks c_i c_j M.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.contact.features.pair_geometry import point_count
from supple.numerics.sparse.couplings import Couplings
from supple.runtime.kernel_cache import njit, prange


@njit(cache=True)
def add_forces(kinds, points, coefficients, sizes, vectors, out):
    """Add the forces sizes (k,) times vectors (k, 3), on the first side, to those `out` (s, 3) on the points."""
    for k in range(len(kinds)):
        for i in range(point_count(kinds[k])):
            for j in range(3):
                out[points[k, i], j] += sizes[k] * coefficients[k, i] * vectors[k, j]


def room_for_blocks(kinds: NDArray[np.int8], points: NDArray[np.int32]) -> tuple[Couplings, NDArray[np.int64]]:
    """Couplings with blocks to be written, one for each unordered pair of points, and where those of each begin."""
    counts = np.minimum(kinds.astype(np.int64) + 2, 4)
    start = np.concatenate([[0], np.cumsum(counts * (counts + 1) // 2)])
    rows, columns = _block_points(kinds, points, start)
    return Couplings(rows, columns, np.empty((len(rows), 3, 3))), start


@njit(cache=True)
def _block_points(kinds, points, start):
    """Rows and columns (t,) of the blocks (i, j), i <= j, of pairs."""
    rows = np.empty(start[-1], dtype=np.int32)
    columns = np.empty(start[-1], dtype=np.int32)
    b = 0
    for k in range(len(kinds)):
        count = point_count(kinds[k])
        for i in range(count):
            for j in range(i, count):
                rows[b], columns[b] = points[k, i], points[k, j]
                b += 1
    return rows, columns


def product_blocks(
    kinds: NDArray[np.int8],
    points: NDArray[np.int32],
    coefficients: NDArray[np.float64],
    sizes: NDArray[np.float64],
    matrices: NDArray[np.float64],
) -> Couplings:
    """The matrix by the points of sizes (k,) times matrices (k, 3, 3)."""
    between, start = room_for_blocks(kinds, points)
    _write_products(kinds, coefficients, sizes, matrices, start, between.blocks)
    return between


@njit(cache=True, parallel=True)
def _write_products(kinds, coefficients, sizes, matrices, start, out):
    for k in prange(len(kinds)):
        count = point_count(kinds[k])
        b = start[k]
        for i in range(count):
            for j in range(i, count):
                size = sizes[k] * coefficients[k, i] * coefficients[k, j]
                for p in range(3):
                    for q in range(3):
                        out[b, p, q] = size * matrices[k, p, q]
                b += 1
