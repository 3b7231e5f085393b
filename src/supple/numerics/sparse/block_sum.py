"""The sum of a block matrix of fixed pattern and sparse blocks that change from solve to solve.

Contacts couple vertices that no element couples, and other ones every time. The joint pattern is made anew where the
contacts' pattern has changed; the matrix of the elements is copied into it, the contacts' blocks are added.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bsr_matrix

from supple.numerics.kernel_cache import njit
from supple.numerics.sparse.block_csr import BlockRows


@dataclass(frozen=True, eq=False)
class JointPattern:
    """The union of two patterns.

    Attributes
    ----------
    rows : the union
    of_base, of_extra : where each block of the two lies in the union; -1 for an extra one without a row
    """

    rows: BlockRows
    of_base: NDArray[np.int32]
    of_extra: NDArray[np.int32]

    def add(self, base: NDArray[np.float64], extra: NDArray[np.float64]) -> NDArray[np.float64]:
        """The blocks (b, 3, 3) of base + extra."""
        data = np.zeros((self.rows.blocks, 3, 3))
        _add(base, self.of_base, extra, self.of_extra, data)
        return data


def join(base: BlockRows, extra: bsr_matrix, row_of: NDArray[np.int32]) -> JointPattern:
    """Unite a pattern with that of a matrix over vertices.

    Parameters
    ----------
    extra : symmetric, (3 n, 3 n) in blocks of 3 x 3; row_of : (n,) row of each vertex, negative where it has none.
    """
    row_start, columns, diagonal, of_base, of_extra = _join(
        base.row_start, base.columns, extra.indptr, extra.indices, row_of
    )
    return JointPattern(BlockRows(row_start, columns, diagonal), of_base, of_extra)


@njit(cache=True, error_model="numpy")
def _join(row_start, columns, extra_start, extra_columns, row_of):
    rows = len(row_start) - 1
    vertex_of = np.full(rows, -1, dtype=np.int32)
    for v in range(len(row_of)):
        if row_of[v] >= 0:
            vertex_of[row_of[v]] = v
    seen = np.full(rows, -1, dtype=np.int32)
    start = np.zeros(rows + 1, dtype=np.int32)
    for i in range(rows):
        for q in range(row_start[i], row_start[i + 1]):
            seen[columns[q]] = i
        count = row_start[i + 1] - row_start[i]
        v = vertex_of[i]
        for q in range(extra_start[v], extra_start[v + 1]):
            j = row_of[extra_columns[q]]
            if j >= 0 and seen[j] != i:
                seen[j] = i
                count += 1
        start[i + 1] = start[i] + count
    joint = np.empty(start[rows], dtype=np.int32)
    diagonal = np.empty(rows, dtype=np.int32)
    of_base = np.empty(len(columns), dtype=np.int32)
    of_extra = np.full(len(extra_columns), -1, dtype=np.int32)
    seen[:] = -1
    where = np.empty(rows, dtype=np.int32)
    for i in range(rows):
        k = start[i]
        for q in range(row_start[i], row_start[i + 1]):
            seen[columns[q]] = i
            joint[k] = columns[q]
            k += 1
        v = vertex_of[i]
        for q in range(extra_start[v], extra_start[v + 1]):
            j = row_of[extra_columns[q]]
            if j >= 0 and seen[j] != i:
                seen[j] = i
                joint[k] = j
                k += 1
        if k - start[i] > row_start[i + 1] - row_start[i]:
            joint[start[i] : k].sort()
        for p in range(start[i], k):
            where[joint[p]] = p
            if joint[p] == i:
                diagonal[i] = p
        for q in range(row_start[i], row_start[i + 1]):
            of_base[q] = where[columns[q]]
        for q in range(extra_start[v], extra_start[v + 1]):
            j = row_of[extra_columns[q]]
            if j >= 0:
                of_extra[q] = where[j]
    return start, joint, diagonal, of_base, of_extra


@njit(cache=True, error_model="numpy")
def _add(base, of_base, extra, of_extra, data):
    for q in range(len(of_base)):
        for r in range(3):
            for c in range(3):
                data[of_base[q], r, c] = base[q, r, c]
    for q in range(len(of_extra)):
        p = of_extra[q]
        if p >= 0:
            for r in range(3):
                for c in range(3):
                    data[p, r, c] += extra[q, r, c]
