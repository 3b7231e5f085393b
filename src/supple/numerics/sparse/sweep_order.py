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
        begin, end = group_start[groups], group_start[groups + 1]
        start = np.append(0, np.cumsum(end - begin)).astype(np.int32)
        rows = _ranges(begin, end).astype(np.int32)
        place = np.empty_like(rows)
        place[rows] = np.arange(len(rows))
        lower, upper = _triangle(pattern, rows, place, 1), _triangle(pattern, rows[::-1], place, -1)
        return cls(rows, pattern.diagonal[rows], groups, start, color_start, lower, upper)

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


def _ranges(begin: NDArray[np.int32], end: NDArray[np.int32]) -> NDArray[np.int64]:
    """The numbers of each range, begin (k,) to end (k,), one range after another."""
    lengths = end - begin
    return np.repeat(begin - (np.cumsum(lengths) - lengths), lengths) + np.arange(lengths.sum())


def _triangle(pattern: BlockRows, rows: NDArray[np.int32], place: NDArray[np.int32], sign: int) -> Triangle:
    """The blocks whose columns have lower places (sign 1) or higher ones (sign -1) than their rows, row after row."""
    begin, end = pattern.row_start[rows], pattern.row_start[rows + 1]
    source, of = _ranges(begin, end), np.repeat(np.arange(len(rows)), end - begin)
    columns = place[pattern.columns[source]]
    beside = sign * columns < sign * place[rows][of]
    start = np.append(0, np.cumsum(np.bincount(of[beside], minlength=len(rows)))).astype(np.int32)
    return Triangle.of(start, columns[beside], source[beside].astype(np.int32))


@njit(cache=True, parallel=True)
def _take(source, data, out):
    for k in prange(len(source)):
        for r in range(3):
            for c in range(3):
                out[k, r, c] = data[source[k], r, c]
