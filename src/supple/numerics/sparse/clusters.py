"""Clusters of strongly coupled rows of a 3x3-block matrix, which a smoother solves for together.

Contact is stiffer than what it acts on by orders of magnitude: relaxation of one vertex after another moves a stiff
pair along its soft direction in many small steps. A pair is strong where |A_ij| / sqrt(|A_ii| |A_jj|), in Frobenius'
norm, is large: about 1 where contact dominates both diagonal blocks, 0.1 to 0.3 between neighbours in a mesh.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.numerics.joined_sets import root_of
from supple.numerics.sparse.block_csr import BlockRows
from supple.runtime.kernel_cache import njit

# Measured on three systems of piles of bears, iterations until the error is 1e-2: without clusters 57, 105, 163; with 4
# rows and strengths above .3 16, 22, 25; with 8 rows 16, 18, 25, where the matrices of clusters are twice the work;
# with 4 rows and all strengths 15, 21, 21.
MOST_ROWS = 4
_STRONG = 0.3


def strong_clusters(pattern: BlockRows, data: NDArray[np.float64]) -> NDArray[np.int32]:
    """(n,) the lowest row of each row's cluster; pairs are joined in the order of their strength.

    Parameters
    ----------
    data : (b, 3, 3) the blocks of a symmetric matrix
    """
    rows, columns, strength = _strong_pairs(pattern.row_start, pattern.columns, pattern.diagonal, data)
    return _joined(rows, columns, np.argsort(-strength, kind="stable"), pattern.rows)


@njit(cache=True)
def _strong_pairs(row_start, columns, diagonal, data):
    """Rows and columns of the strong blocks right of the diagonal, and the fourth powers of their strengths."""
    n, count = len(diagonal), 0
    size = np.empty(len(columns))
    for q in range(len(columns)):
        total = 0.0
        for r in range(3):
            for c in range(3):
                total += data[q, r, c] * data[q, r, c]
        size[q] = total
    chosen = np.empty(len(columns), dtype=np.int32)
    of = np.empty(len(columns), dtype=np.int32)
    for i in range(n):
        for q in range(diagonal[i] + 1, row_start[i + 1]):
            if size[q] * size[q] > _STRONG**4 * size[diagonal[i]] * size[diagonal[columns[q]]]:
                chosen[count], of[count] = q, i
                count += 1
    strength = np.empty(count)
    for k in range(count):
        q = chosen[k]
        strength[k] = size[q] * size[q] / (size[diagonal[of[k]]] * size[diagonal[columns[q]]])
    return of[:count].copy(), columns[chosen[:count]], strength


@njit(cache=True)
def _joined(rows, columns, order, n):
    parent, size = np.arange(n).astype(np.int32), np.ones(n, dtype=np.int32)
    for k in order:
        a, b = root_of(parent, rows[k]), root_of(parent, columns[k])
        if a != b and size[a] + size[b] <= MOST_ROWS:
            a, b = min(a, b), max(a, b)
            parent[b] = a
            size[a] += size[b]
    for i in range(n):
        parent[i] = root_of(parent, i)
    return parent
