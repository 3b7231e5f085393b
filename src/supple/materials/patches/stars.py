"""A partition of tets into patches of about the tets around one vertex."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.numerics.adjacency import adjacency
from supple.runtime.kernel_cache import njit

# The least number of tets of a new patch, round after round. A patch with a vertex inside can deform without a change
# of its volume; smaller ones are made only where a body is too thin for that.
_LEAST = (12, 6, 3, 1)


def star_patches(of_vertex: NDArray[np.int32], of_edge: NDArray[np.int32]) -> NDArray[np.int32]:
    """(m,) the patch of every tet.

    Each round begins patches with the tets around vertices that are in none yet, the largest ones first, and then adds
    to the smallest patch beside it each tet that is left.

    Parameters
    ----------
    of_vertex, of_edge : (m, 4) and (m, 6) numbers of the stars of vertices and edges that each tet belongs to
    """
    m = len(of_vertex)
    around_vertices = adjacency(of_vertex.ravel(), np.repeat(np.arange(m), 4), int(of_vertex.max()) + 1)
    around_edges = adjacency(of_edge.ravel(), np.repeat(np.arange(m), 6), int(of_edge.max()) + 1)
    patch, size = np.full(m, -1, dtype=np.int32), np.zeros(m, dtype=np.int32)
    count = 0
    for least in _LEAST:
        count = _begin_patches(around_vertices, least, count, patch, size)
        _add_to_smallest(around_edges, of_edge, patch, size)
    return patch


@njit(cache=True)
def _begin_patches(around, least, count, patch, size):
    """Make patches of the tets around vertices that have none, at least `least`; returns the number of patches."""
    start, tets = around
    free = np.zeros(len(start) - 1, dtype=np.int32)
    for a in range(len(free)):
        for p in range(start[a], start[a + 1]):
            free[a] += patch[tets[p]] < 0
    for most in range(free.max(), least - 1, -1):
        for a in range(len(free)):
            if free[a] != most:
                continue
            free[a] = 0
            for p in range(start[a], start[a + 1]):
                free[a] += patch[tets[p]] < 0
            if free[a] == most:
                for p in range(start[a], start[a + 1]):
                    if patch[tets[p]] < 0:
                        patch[tets[p]] = count
                size[count] = most
                count += 1
                free[a] = 0
    return count


@njit(cache=True)
def _add_to_smallest(around, of_edge, patch, size):
    """Add each tet without a patch that shares an edge with one to the smallest of these."""
    start, tets = around
    found = np.full(len(patch), -1, dtype=np.int32)
    for e in range(len(patch)):
        if patch[e] >= 0:
            continue
        for k in range(6):
            for p in range(start[of_edge[e, k]], start[of_edge[e, k] + 1]):
                other = patch[tets[p]]
                if other >= 0 and (found[e] < 0 or size[other] < size[found[e]]):
                    found[e] = other
        if found[e] >= 0:
            size[found[e]] += 1
    for e in range(len(patch)):
        if found[e] >= 0:
            patch[e] = found[e]
