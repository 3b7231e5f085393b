"""The order of a Gauss-Seidel sweep over the rows of a 3x3-block matrix, and the matrix in that order.

Groups of rows have colors, so that no two of one color are coupled: those of one color are swept at the same time, with
the same bits on any number of threads. Within a group, the rows of a cluster follow each other; the blocks within a
cluster are its diagonal. A sweep forward reads the blocks left of the diagonal, one backward those right of it. Both
are stored in the order in which they are read, the right ones from the last row to the first: read in descending order
from beyond the cache, they take five times as long.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.numerics.sparse.block_csr import BlockRows
from supple.runtime.kernel_cache import njit, prange


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
    rows : (n,) row at each place; color_start : (c + 1,) first group of each color
    group_start : (g + 1,) first cluster of each group, in the order of the sweep
    cluster_start : (k + 1,) first place of each cluster
    dense_start : (k + 1,) first number of each cluster's matrix, row after row, where all are written one after another
    dense_source : where each 3x3 block of these is in the matrix, -1 for zero; cluster after cluster, row after row
    lower : from the first place to the last; upper : from the last place to the first
    """

    rows: NDArray[np.int32]
    color_start: NDArray[np.int32]
    group_start: NDArray[np.int32]
    cluster_start: NDArray[np.int32]
    dense_start: NDArray[np.int32]
    dense_source: NDArray[np.int32]
    lower: Triangle
    upper: Triangle

    @classmethod
    def of(cls, pattern: BlockRows, group_of: NDArray[np.int32], cluster_of: NDArray[np.int32]) -> SweepOrder:
        """Color the groups of a pattern. A cluster belongs to the group of its lowest row.

        Parameters
        ----------
        group_of : (n,) group of each row; cluster_of : (n,) lowest row of each row's cluster
        """
        n = pattern.rows
        group = group_of[cluster_of]
        by_group = np.lexsort((cluster_of, group)).astype(np.int32)
        groups = int(group_of.max(initial=-1)) + 1
        begin = np.append(0, np.cumsum(np.bincount(group, minlength=groups))).astype(np.int32)
        colors = _colors(pattern.row_start, pattern.columns, by_group, begin, group)
        sequence = np.argsort(colors, kind="stable").astype(np.int32)
        rows = by_group[_ranges(begin[sequence], begin[sequence + 1])]
        place = np.empty_like(rows)
        place[rows] = np.arange(n)
        cluster = np.cumsum(np.append(True, np.diff(cluster_of[rows]) != 0)[:n]) - 1  # of each place
        cluster_start = np.append(0, np.cumsum(np.bincount(cluster))).astype(np.int32)
        sizes = np.diff(cluster_start).astype(np.int64)
        places_of_groups = np.append(0, np.cumsum(np.diff(begin)[sequence]))
        dense = np.append(0, np.cumsum(sizes**2)).astype(np.int32)
        dense_source, lower, upper = _parts(
            pattern.row_start, pattern.columns, rows, place, cluster, cluster_start, dense
        )
        return cls(
            rows,
            np.append(0, np.cumsum(np.bincount(colors))).astype(np.int32),
            np.searchsorted(cluster_start, places_of_groups).astype(np.int32),
            cluster_start,
            9 * dense,
            dense_source,
            Triangle.of(*lower),
            Triangle.of(*upper),
        )

    def take(self, data: NDArray[np.float64]) -> None:
        """Copy the blocks (b, 3, 3) of a matrix beside the diagonal."""
        for triangle in (self.lower, self.upper):
            _take(triangle.source, data, triangle.blocks)


@njit(cache=True)
def _colors(row_start, columns, rows, group_start, group):
    """(g,) for each group in turn the first color that no group has that it is coupled with."""
    groups = len(group_start) - 1
    colors = np.full(groups, -1, dtype=np.int32)
    taken = np.full(groups + 1, -1, dtype=np.int32)
    for g in range(groups):
        for k in range(group_start[g], group_start[g + 1]):
            i = rows[k]
            for q in range(row_start[i], row_start[i + 1]):
                if group[columns[q]] < g:
                    taken[colors[group[columns[q]]]] = g
        color = 0
        while taken[color] == g:
            color += 1
        colors[g] = color
    return colors


def _ranges(begin: NDArray[np.int32], end: NDArray[np.int32]) -> NDArray[np.int64]:
    """The numbers of each range, begin (k,) to end (k,), one range after another."""
    lengths = end - begin
    return np.repeat(begin - (np.cumsum(lengths) - lengths), lengths) + np.arange(lengths.sum())


@njit(cache=True)
def _parts(row_start, columns, rows, place, cluster, cluster_start, dense_start):
    """The sources of the clusters' matrices, and of both triangles starts, columns and sources."""
    n = len(rows)
    dense_source = np.full(dense_start[-1], -1, dtype=np.int32)
    lower_start, upper_start = np.zeros(n + 1, dtype=np.int32), np.zeros(n + 1, dtype=np.int32)
    for i in range(n):
        k = cluster[i]
        for q in range(row_start[rows[i]], row_start[rows[i] + 1]):
            j = place[columns[q]]
            if j < cluster_start[k]:
                lower_start[i + 1] += 1
            elif j >= cluster_start[k + 1]:
                upper_start[n - i] += 1
            else:
                size = cluster_start[k + 1] - cluster_start[k]
                dense_source[dense_start[k] + (i - cluster_start[k]) * size + j - cluster_start[k]] = q
    for i in range(n):
        lower_start[i + 1] += lower_start[i]
        upper_start[i + 1] += upper_start[i]
    lower, lower_source = np.empty(lower_start[n], dtype=np.int32), np.empty(lower_start[n], dtype=np.int32)
    upper, upper_source = np.empty(upper_start[n], dtype=np.int32), np.empty(upper_start[n], dtype=np.int32)
    for i in range(n):
        k = cluster[i]
        at, to = lower_start[i], upper_start[n - 1 - i]
        for q in range(row_start[rows[i]], row_start[rows[i] + 1]):
            j = place[columns[q]]
            if j < cluster_start[k]:
                lower[at], lower_source[at] = j, q
                at += 1
            elif j >= cluster_start[k + 1]:
                upper[to], upper_source[to] = j, q
                to += 1
    return dense_source, (lower_start, lower, lower_source), (upper_start, upper, upper_source)


@njit(cache=True, parallel=True)
def _take(source, data, out):
    for k in prange(len(source)):
        for r in range(3):
            for c in range(3):
                out[k, r, c] = data[source[k], r, c]
