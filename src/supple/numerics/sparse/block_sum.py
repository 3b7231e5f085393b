"""The sum of element matrices and of couplings that change from solve to solve.

Contacts couple vertices that no element couples, and other ones every time. The joint pattern is made again where a
coupling has no block in it. Assembly gathers, as that of the elements alone: each block is written by one thread, its
element entries first, then its couplings in their order. Any number of threads gives the same bits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.numerics.sparse.block_csr import BlockPattern, assemble_row
from supple.numerics.sparse.couplings import Couplings
from supple.runtime.kernel_cache import njit, prange


@dataclass(frozen=True, eq=False)
class CouplingPlaces:
    """Where couplings add up.

    Attributes
    ----------
    rows, columns : (t,) the couplings' vertices
    start : (b + 1,) and entries : the couplings of each upper block, coded 2 t + 1 where the transpose is added
    """

    rows: NDArray[np.int32]
    columns: NDArray[np.int32]
    start: NDArray[np.int32]
    entries: NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class JointPattern:
    """The blocks of elements and of couplings.

    Attributes
    ----------
    pattern : all blocks, with the element entries of each
    row_of : (n,) row of each vertex, negative where it has none; couplings of such a vertex are left out
    """

    pattern: BlockPattern
    row_of: NDArray[np.int32]

    @classmethod
    def of(cls, elements: BlockPattern, couplings: Couplings, row_of: NDArray[np.int32]) -> JointPattern:
        """Add blocks for couplings to the pattern of the elements."""
        row_start, columns, diagonal, mirror, entry_start = _join(
            elements.row_start,
            elements.columns,
            elements.entry_start,
            couplings.rows,
            couplings.columns,
            row_of,
        )
        pattern = BlockPattern(row_start, columns, diagonal, mirror, entry_start, elements.entries)
        return cls(pattern, row_of)

    def places(self, couplings: Couplings) -> CouplingPlaces | None:
        """Where couplings add up; None where one has no block in this pattern."""
        p = self.pattern
        start, entries = _places(p.row_start, p.columns, couplings.rows, couplings.columns, self.row_of)
        return None if start[0] < 0 else CouplingPlaces(couplings.rows, couplings.columns, start, entries)

    def assemble(
        self,
        element_blocks: NDArray[np.float64],
        diagonal_blocks: NDArray[np.float64],
        coupling_blocks: NDArray[np.float64],
        places: CouplingPlaces,
        data: NDArray[np.float64],
    ) -> None:
        """Sum element matrices, per-vertex blocks and couplings into `data` (b, 3, 3).

        Parameters
        ----------
        element_blocks, diagonal_blocks : see `BlockPattern.assemble`
        coupling_blocks : (t, 3, 3)
        """
        p = self.pattern
        _assemble(
            p.row_start,
            p.columns,
            p.mirror,
            p.entry_start,
            p.entries,
            element_blocks,
            diagonal_blocks,
            places.start,
            places.entries,
            coupling_blocks,
            data,
        )


@njit
def _partners(rows, columns, row_of, n):
    """For every row the rows that couplings join it to: starts (n + 1,) and numbers, which may repeat."""
    start = np.zeros(n + 1, dtype=np.int32)
    for t in range(len(rows)):
        i, j = row_of[rows[t]], row_of[columns[t]]
        if i >= 0 and j >= 0 and i != j:
            start[i + 1] += 1
            start[j + 1] += 1
    for i in range(n):
        start[i + 1] += start[i]
    partners = np.empty(start[n], dtype=np.int32)
    put = start[:-1].copy()
    for t in range(len(rows)):
        i, j = row_of[rows[t]], row_of[columns[t]]
        if i >= 0 and j >= 0 and i != j:
            partners[put[i]] = j
            put[i] += 1
            partners[put[j]] = i
            put[j] += 1
    return start, partners


@njit(cache=True)
def _join(row_start, columns, entry_start, coupled_rows, coupled_columns, row_of):
    """The union of the elements' blocks and those of couplings, with the arrays of `BlockPattern` but the entries.

    The element entries of a block keep their order, and blocks of couplings alone have none, so that the list of
    entries stays as it is.
    """
    n = len(row_start) - 1
    partner_start, partners = _partners(coupled_rows, coupled_columns, row_of, n)
    most = len(columns) + len(partners)
    start = np.zeros(n + 1, dtype=np.int32)
    joint = np.empty(most, dtype=np.int32)
    diagonal = np.empty(n, dtype=np.int32)
    entries = np.zeros(most + 1, dtype=np.int32)
    seen = np.full(n, -1, dtype=np.int32)
    k = 0
    for i in range(n):
        begin = k
        for q in range(row_start[i], row_start[i + 1]):
            seen[columns[q]] = i
            joint[k] = columns[q]
            k += 1
        own = k
        for q in range(partner_start[i], partner_start[i + 1]):
            j = partners[q]
            if seen[j] != i:
                seen[j] = i
                joint[k] = j
                k += 1
        if k > own:
            joint[begin:k].sort()
        start[i + 1] = k
        q = row_start[i]
        for p in range(begin, k):
            if joint[p] == i:
                diagonal[i] = p
            entries[p] = entry_start[q]
            if q < row_start[i + 1] and joint[p] == columns[q]:
                q += 1
    entries[k] = entry_start[len(columns)]
    # Row by row, the blocks right of the diagonal are met in the order in which their transposes stand in their rows.
    mirror = np.empty(k, dtype=np.int32)
    met = start[:-1].copy()
    for i in range(n):
        for p in range(diagonal[i], start[i + 1]):
            t = met[joint[p]]
            met[joint[p]] += 1
            mirror[p] = t
            mirror[t] = p
    return start, joint[:k].copy(), diagonal, mirror, entries[: k + 1].copy()


@njit(cache=True)
def _places(row_start, columns, coupled_rows, coupled_columns, row_of):
    """The arrays of `CouplingPlaces`; the first start is -1 where a coupling has no block."""
    blocks = len(columns)
    start = np.zeros(blocks + 1, dtype=np.int32)
    where = np.full(len(coupled_rows), -1, dtype=np.int32)
    for t in range(len(coupled_rows)):
        i, j = row_of[coupled_rows[t]], row_of[coupled_columns[t]]
        if i < 0 or j < 0:
            continue
        low, high = row_start[min(i, j)], row_start[min(i, j) + 1]
        end = high
        while low < high:
            middle = (low + high) >> 1
            if columns[middle] < max(i, j):
                low = middle + 1
            else:
                high = middle
        if low == end or columns[low] != max(i, j):
            start[0] = -1
            return start, where
        where[t] = low
        start[low + 1] += 1
    for q in range(blocks):
        start[q + 1] += start[q]
    entries = np.empty(start[blocks], dtype=np.int32)
    put = start[:-1].copy()
    for t in range(len(where)):
        q = where[t]
        if q >= 0:
            entries[put[q]] = 2 * t + (1 if row_of[coupled_rows[t]] > row_of[coupled_columns[t]] else 0)
            put[q] += 1
    return start, entries


@njit
def _add_row(i, row_start, columns, mirror, coupling_start, couplings, blocks, data):
    for q in range(row_start[i], row_start[i + 1]):
        j = columns[q]
        if j < i or coupling_start[q] == coupling_start[q + 1]:
            continue
        for p in range(coupling_start[q], coupling_start[q + 1]):
            t = couplings[p] >> 1
            if couplings[p] & 1:
                for r in range(3):
                    for c in range(3):
                        data[q, r, c] += blocks[t, c, r]
            else:
                for r in range(3):
                    for c in range(3):
                        data[q, r, c] += blocks[t, r, c]
        if j == i:
            # Blocks are symmetric up to round-off only; the matrix is symmetric to the last bit.
            for r in range(3):
                for c in range(r):
                    data[q, r, c] = data[q, c, r]
        else:
            m = mirror[q]
            for r in range(3):
                for c in range(3):
                    data[m, c, r] = data[q, r, c]


@njit(cache=True, parallel=True)
def _assemble(
    row_start,
    columns,
    mirror,
    entry_start,
    entries,
    element_blocks,
    diagonal_blocks,
    coupling_start,
    couplings,
    coupling_blocks,
    data,
):
    for i in prange(len(row_start) - 1):
        assemble_row(i, row_start, columns, mirror, entry_start, entries, element_blocks, diagonal_blocks, data)
        _add_row(i, row_start, columns, mirror, coupling_start, couplings, coupling_blocks, data)
