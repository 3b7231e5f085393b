"""Which vertices and pairs of vertices the nodes of quadratic tets add to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Gathering:
    """Attributes
    ----------
    start : (n + 1,) and entries : by vertex, the (element, node) pairs that name it, coded 10 element + node
    rows, columns : (p,) pairs of vertices of one element, row <= column
    pair_start : (p + 1,) and pair_entries : by pair, 2 (100 element + 10 a + b) for nodes a <= b; plus 1 where the
        transpose of the block is added
    """

    start: NDArray[np.int32]
    entries: NDArray[np.int64]
    rows: NDArray[np.int32]
    columns: NDArray[np.int32]
    pair_start: NDArray[np.int64]
    pair_entries: NDArray[np.int64]

    @classmethod
    def of(cls, nodes: NDArray[np.int32], vertices: int) -> Gathering:
        """Of elements with nodes (k, 10) among `vertices`."""
        flat = nodes.ravel()
        start = np.concatenate([[0], np.cumsum(np.bincount(flat, minlength=vertices))]).astype(np.int32)
        entries = np.argsort(flat, kind="stable")
        a, b = np.triu_indices(10)
        first, second = nodes[:, a].astype(np.int64), nodes[:, b].astype(np.int64)
        keys = (np.minimum(first, second) * vertices + np.maximum(first, second)).ravel()
        codes = (2 * (100 * np.arange(len(nodes))[:, None] + 10 * a + b) + (first > second)).ravel()
        order = np.argsort(keys, kind="stable")
        pairs, begins = np.unique(keys[order], return_index=True)
        rows, columns = np.divmod(pairs, vertices)
        pair_start = np.append(begins, len(keys)).astype(np.int64)
        return cls(start, entries, rows.astype(np.int32), columns.astype(np.int32), pair_start, codes[order])
