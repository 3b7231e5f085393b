"""Disjoint sets of numbers as trees: each number has a parent, and the root of a set is its own."""

from __future__ import annotations

from supple.runtime.kernel_cache import njit


@njit
def root_of(parent, k):
    """The root of the set of k; paths in `parent` (n,) are halved on the way."""
    while parent[k] != k:
        parent[k] = parent[parent[k]]
        k = parent[k]
    return k


@njit(cache=True)
def unite(rows, columns, piece, root):
    """Join the pieces of coupled nodes; `root` (p + 1,) names one piece of each set.

    Parameters
    ----------
    rows, columns : (k,) the nodes that are coupled; piece : (n,) of each node, -1 where it is held: one more piece, the
        last one
    """
    held = len(root) - 1
    for t in range(len(rows)):
        i, j = piece[rows[t]], piece[columns[t]]
        if i != j:
            a, b = root_of(root, held if i < 0 else i), root_of(root, held if j < 0 else j)
            root[min(a, b)] = max(a, b)
    for k in range(held):
        root[k] = root_of(root, k)
