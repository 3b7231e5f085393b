"""Sparse symmetric matrices of 3x3 blocks, assembled from element matrices without sorting anything twice.

The pattern is built once from the elements. Every block of the upper triangle knows the element entries that add up to
it, so assembly gathers: each block is written by one thread, in one order, and its transpose is copied to the mirror
block. Any number of threads gives the same bits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bsr_matrix

from supple.runtime.kernel_cache import njit, prange


@dataclass(frozen=True, eq=False)
class BlockRows:
    """Where a block matrix has its blocks.

    Attributes
    ----------
    row_start : (n + 1,) first block of each row; columns : (b,) ascending in each row
    diagonal : (n,) index of each row's diagonal block
    """

    row_start: NDArray[np.int32]
    columns: NDArray[np.int32]
    diagonal: NDArray[np.int32]

    @property
    def rows(self) -> int:
        return len(self.diagonal)

    @property
    def blocks(self) -> int:
        return len(self.columns)

    def to_scipy(self, data: NDArray[np.float64]) -> bsr_matrix:
        """The matrix as SciPy knows it, (3n, 3n); shares memory with `data`."""
        size = 3 * self.rows
        return bsr_matrix((data, self.columns, self.row_start), shape=(size, size))


@dataclass(frozen=True, eq=False)
class BlockPattern(BlockRows):
    """Where a symmetric block matrix has its blocks, and which element entries make each of them.

    Attributes
    ----------
    mirror : (b,) index of each block's transpose
    entry_start : (b + 1,) and entries : the element entries of each upper block, as 16 element + 4 a + c for the 3x3
        block of the element's nodes a and c
    """

    mirror: NDArray[np.int32]
    entry_start: NDArray[np.int32]
    entries: NDArray[np.int32]

    def assemble(
        self, element_blocks: NDArray[np.float64], diagonal_blocks: NDArray[np.float64], data: NDArray[np.float64]
    ) -> None:
        """Sum element matrices and per-vertex blocks into `data`.

        Parameters
        ----------
        element_blocks : (m, 12, 12) symmetric matrices of the elements the pattern was built from
        diagonal_blocks : (n, 3, 3) symmetric, added to the diagonal
        data : (b, 3, 3) overwritten
        """
        _assemble(
            self.row_start,
            self.columns,
            self.mirror,
            self.entry_start,
            self.entries,
            element_blocks,
            diagonal_blocks,
            data,
        )


def build_pattern(elements: NDArray[np.int32], rows: int) -> BlockPattern:
    """The pattern of all elements' couplings, every diagonal block included.

    Parameters
    ----------
    elements : (m, 4) row of each node; negative where the node has no row (it is held).
    rows : number of block rows n.
    """
    nodes = np.asarray(elements, dtype=np.int64)
    # Entry 16 e + 4 a + c couples row i, of node a, with row j, of node c.
    i, j = np.repeat(nodes, 4, axis=1).ravel(), np.tile(nodes, (1, 4)).ravel()
    entries = np.flatnonzero((i >= 0) & (j >= 0))
    i, j = i[entries], j[entries]
    both, block = np.unique(np.concatenate([np.arange(rows) * (rows + 1), i * rows + j]), return_inverse=True)
    row, columns = np.divmod(both, max(rows, 1))
    upper = np.flatnonzero(j >= i)
    of_upper = block[rows:][upper]
    order = np.argsort(of_upper, kind="stable")
    return BlockPattern(
        row_start=np.searchsorted(row, np.arange(rows + 1)).astype(np.int32),
        columns=columns.astype(np.int32),
        diagonal=block[:rows].astype(np.int32),
        mirror=np.searchsorted(both, columns * rows + row).astype(np.int32),
        entry_start=np.searchsorted(of_upper[order], np.arange(len(both) + 1)).astype(np.int32),
        entries=entries[upper][order].astype(np.int32),
    )


def incidences(elements: NDArray[np.int32], rows: int) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Starts (rows + 1,) and, for every row, the (element, node) pairs, coded 4 element + node, that name it."""
    nodes = elements.ravel()
    used = np.flatnonzero(nodes >= 0)
    incidence = used[np.argsort(nodes[used], kind="stable")]
    start = np.concatenate([[0], np.cumsum(np.bincount(nodes[used], minlength=rows))])
    return start.astype(np.int32), incidence.astype(np.int32)


@njit
def assemble_row(i, row_start, columns, mirror, entry_start, entries, element_blocks, diagonal_blocks, data):
    """Write the blocks of row i from the diagonal on, and their transposes."""
    for q in range(row_start[i], row_start[i + 1]):
        j = columns[q]
        if j < i:
            continue
        d00 = d01 = d02 = d10 = d11 = d12 = d20 = d21 = d22 = 0.0
        for p in range(entry_start[q], entry_start[q + 1]):
            code = entries[p]
            e = code >> 4
            r = 3 * ((code >> 2) & 3)
            c = 3 * (code & 3)
            d00 += element_blocks[e, r, c]
            d01 += element_blocks[e, r, c + 1]
            d02 += element_blocks[e, r, c + 2]
            d10 += element_blocks[e, r + 1, c]
            d11 += element_blocks[e, r + 1, c + 1]
            d12 += element_blocks[e, r + 1, c + 2]
            d20 += element_blocks[e, r + 2, c]
            d21 += element_blocks[e, r + 2, c + 1]
            d22 += element_blocks[e, r + 2, c + 2]
        if j == i:
            d00 += diagonal_blocks[i, 0, 0]
            d01 += diagonal_blocks[i, 0, 1]
            d02 += diagonal_blocks[i, 0, 2]
            d11 += diagonal_blocks[i, 1, 1]
            d12 += diagonal_blocks[i, 1, 2]
            d22 += diagonal_blocks[i, 2, 2]
            # Element matrices are symmetric up to round-off only; the matrix is symmetric to the last bit.
            d10, d20, d21 = d01, d02, d12
        data[q, 0, 0] = d00
        data[q, 0, 1] = d01
        data[q, 0, 2] = d02
        data[q, 1, 0] = d10
        data[q, 1, 1] = d11
        data[q, 1, 2] = d12
        data[q, 2, 0] = d20
        data[q, 2, 1] = d21
        data[q, 2, 2] = d22
        if j != i:
            t = mirror[q]
            data[t, 0, 0] = d00
            data[t, 1, 0] = d01
            data[t, 2, 0] = d02
            data[t, 0, 1] = d10
            data[t, 1, 1] = d11
            data[t, 2, 1] = d12
            data[t, 0, 2] = d20
            data[t, 1, 2] = d21
            data[t, 2, 2] = d22


@njit(cache=True, parallel=True)
def _assemble(row_start, columns, mirror, entry_start, entries, element_blocks, diagonal_blocks, data):
    for i in prange(len(row_start) - 1):
        assemble_row(i, row_start, columns, mirror, entry_start, entries, element_blocks, diagonal_blocks, data)
