"""The order of a Gauss-Seidel sweep over the rows of a 3x3-block matrix, and the matrix in that order.

Groups of rows have colors, so that no two of one color are coupled: those of one color are swept at the same time, with
the same bits on any number of threads. A sweep forward reads the blocks left of the diagonal, one backward those right
of it. Both are stored in the order in which they are read, the right ones from the last row to the first: read in
descending order from beyond the cache, they take five times as long.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.numerics.sparse.block_csr import SERIAL_BLOCKS, BlockRows
from supple.runtime.kernel_cache import njit, prange
from supple.runtime.threads import threads_for


@dataclass(frozen=True, eq=False)
class Triangle:
    """The blocks on one side of the diagonal, row after row in the order of their sweep.

    Attributes
    ----------
    start : (n + 1,) first block of each row; columns : (b,) places in the sweep forward
    source : (b,) where each block is in the matrix; blocks : (b, 3, 3)
    """

    start: NDArray[np.int32]
    columns: NDArray[np.int32]
    source: NDArray[np.int32]
    blocks: NDArray[np.float64]

    @classmethod
    def of(cls, start: NDArray[np.int32], columns: NDArray[np.int32], source: NDArray[np.int32]) -> Triangle:
        """Memory for the blocks."""
        return cls(start, columns, source, np.empty((len(columns), 3, 3)))


@dataclass(frozen=True, eq=False)
class SweepOrder:
    """The rows of a matrix in the order of a sweep.

    Attributes
    ----------
    rows : (n,) row at each place; diagonal_source : (n,) where its diagonal block is in the matrix
    groups : (g,) group at each place; group_start : (g + 1,) first place of its rows
    color_start : (c + 1,) first group of each color
    lower : from the first place to the last; upper : from the last place to the first
    """

    rows: NDArray[np.int32]
    diagonal_source: NDArray[np.int32]
    groups: NDArray[np.int32]
    group_start: NDArray[np.int32]
    color_start: NDArray[np.int32]
    lower: Triangle
    upper: Triangle

    @classmethod
    def of(cls, pattern: BlockRows, group_start: NDArray[np.int32], group_of: NDArray[np.int32]) -> SweepOrder:
        """Color the groups of a pattern.

        Parameters
        ----------
        group_start : (g + 1,) first row of each group; group_of : (n,) group of each row
        """
        colors = _colors(pattern.row_start, pattern.columns, group_start, group_of)
        groups = np.argsort(colors, kind="stable").astype(np.int32)
        color_start = np.append(0, np.cumsum(np.bincount(colors))).astype(np.int32)
        rows, start, lower, upper = _triangles(pattern.row_start, pattern.columns, group_start, groups)
        return cls(rows, pattern.diagonal[rows], groups, start, color_start, Triangle.of(*lower), Triangle.of(*upper))

    def take(self, data: NDArray[np.float64]) -> None:
        """Copy the blocks (b, 3, 3) of a matrix beside the diagonal."""
        with threads_for(len(data), SERIAL_BLOCKS):
            for triangle in (self.lower, self.upper):
                _take(triangle.source, data, triangle.blocks)


@njit(cache=True)
def _colors(row_start, columns, group_start, group_of):
    """(g,) for each group in turn the first color that no group has that it is coupled with."""
    groups = len(group_start) - 1
    colors = np.full(groups, -1, dtype=np.int32)
    taken = np.full(groups + 1, -1, dtype=np.int32)
    for g in range(groups):
        for i in range(group_start[g], group_start[g + 1]):
            for q in range(row_start[i], row_start[i + 1]):
                if columns[q] >= group_start[g]:
                    break
                taken[colors[group_of[columns[q]]]] = g
        color = 0
        while taken[color] == g:
            color += 1
        colors[g] = color
    return colors


@njit(cache=True)
def _triangles(row_start, columns, group_start, groups):
    """Rows and starts of groups in the order of `groups`, and both triangles: starts, columns, sources."""
    n = len(row_start) - 1
    rows = np.empty(n, dtype=np.int32)
    start = np.zeros(len(groups) + 1, dtype=np.int32)
    place = np.empty(n, dtype=np.int32)
    k = 0
    for g in range(len(groups)):
        for i in range(group_start[groups[g]], group_start[groups[g] + 1]):
            rows[k] = i
            place[i] = k
            k += 1
        start[g + 1] = k
    lower_start = np.zeros(n + 1, dtype=np.int32)
    upper_start = np.zeros(n + 1, dtype=np.int32)
    beside = (len(columns) - n) // 2
    lower = np.empty((2, beside), dtype=np.int32)
    upper = np.empty((2, beside), dtype=np.int32)
    low = high = 0
    for k in range(n):
        last = n - 1 - k
        for q in range(row_start[rows[k]], row_start[rows[k] + 1]):
            if place[columns[q]] < k:
                lower[0, low] = place[columns[q]]
                lower[1, low] = q
                low += 1
        for q in range(row_start[rows[last]], row_start[rows[last] + 1]):
            if place[columns[q]] > last:
                upper[0, high] = place[columns[q]]
                upper[1, high] = q
                high += 1
        lower_start[k + 1] = low
        upper_start[k + 1] = high
    return rows, start, (lower_start, lower[0], lower[1]), (upper_start, upper[0], upper[1])


@njit(cache=True, parallel=True)
def _take(source, data, out):
    for k in prange(len(source)):
        for r in range(3):
            for c in range(3):
                out[k, r, c] = data[source[k], r, c]
