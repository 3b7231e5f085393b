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
