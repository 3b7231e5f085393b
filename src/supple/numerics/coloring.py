"""Which constraints may be projected at the same time, and in which order one thread should project them.

Two constraints are independent where they share no vertex. `breadth_first_order` divides the vertices of a mesh
into levels such that a constraint has vertices of at most two neighbouring levels; `independent_groups` finds
independent constraints near each other.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.runtime.kernel_cache import njit


def breadth_first_order(constraints: list[NDArray[np.int32]], n_vertices: int) -> tuple[NDArray, NDArray]:
    """Number the vertices along breadth-first levels, one connected piece after the other.

    Every constraint joins vertices of one level or of two neighbouring levels, because all its vertices are neighbours
    of each other. The numbering of each piece starts at the vertex that a first search reaches last, so that there are
    many small levels instead of a few large ones.

    Parameters
    ----------
    constraints : (m, k) vertex indices each; all vertices of a constraint are neighbours of each other.
    n_vertices : number of vertices.

    Returns
    -------
    order : (n_vertices,) int32, the vertices in the order in which they are reached.
    levels : (n_vertices,) int32, the level of each vertex, growing by one from piece to piece.
    """
    pairs = [rows[:, [i, j]] for rows in constraints for i in range(rows.shape[1]) for j in range(i)]
    joined = np.concatenate([np.zeros((0, 2), dtype=np.int32), *pairs])
    # The neighbours of each vertex in the order of the pairs.
    by_vertex = np.argsort(joined.ravel(), kind="stable")
    pointers = np.concatenate([[0], np.cumsum(np.bincount(joined.ravel(), minlength=n_vertices))])
    return _breadth_first(pointers, joined[:, ::-1].ravel()[by_vertex])


@njit(cache=True)
def _breadth_first(pointers, neighbours):
    n = len(pointers) - 1
    order = np.empty(n, dtype=np.int32)
    levels = np.full(n, -1, dtype=np.int32)
    done = 0
    first_level = 0
    count = 0
    for seed in range(n):
        if levels[seed] >= 0:
            continue
        start = seed
        for search in range(2):
            # The first search finds a distant vertex to start from; the second one numbers.
            if search == 1:
                start = order[done + count - 1]
                for k in range(done, done + count):
                    levels[order[k]] = -1
            order[done] = start
            levels[start] = first_level
            count = 1
            head = 0
            while head < count:
                i = order[done + head]
                head += 1
                for k in range(pointers[i], pointers[i + 1]):
                    j = neighbours[k]
                    if levels[j] < 0:
                        levels[j] = levels[i] + 1
                        order[done + count] = j
                        count += 1
        first_level = levels[order[done + count - 1]] + 1
        done += count
    return order, levels


@njit(cache=True)
def independent_groups(constraints, starts, n_vertices, width, window):
    """Divide runs of constraints into groups of at most `width`, in which no two constraints share a vertex.

    Each group takes, in order, what is independent among the next `window` constraints that have no group yet, so that
    a group's constraints are near each other.

    Parameters
    ----------
    constraints : (m, k) int32 vertex indices
    starts : (r + 1,) first constraint of each run; groups do not cross runs
    n_vertices : number of vertices

    Returns
    -------
    members : (g, width) int64 constraints; in a group that is not full, the first one fills the rest
    counts : (g,) int64 constraints in each group; pointers : (r + 1,) int64 the first group of each run
    """
    m, k = constraints.shape
    members = np.empty((m, width), dtype=np.int64)
    counts = np.empty(m, dtype=np.int64)
    pointers = np.zeros(len(starts), dtype=np.int64)
    owner = np.empty(n_vertices, dtype=np.int64)
    for i in range(n_vertices):
        owner[i] = -1
    pending = np.empty(window, dtype=np.int64)
    group = 0
    for run in range(len(starts) - 1):
        next_one, waiting = starts[run], 0
        while next_one < starts[run + 1] or waiting > 0:
            while next_one < starts[run + 1] and waiting < window:
                pending[waiting] = next_one
                waiting += 1
                next_one += 1
            count, kept = 0, 0
            for q in range(waiting):
                c = pending[q]
                free = count < width
                for a in range(k):
                    free = free and owner[constraints[c, a]] != group
                if free:
                    for a in range(k):
                        owner[constraints[c, a]] = group
                    members[group, count] = c
                    count += 1
                else:
                    pending[kept] = c
                    kept += 1
            waiting = kept
            for q in range(count, width):
                members[group, q] = members[group, 0]
            counts[group] = count
            group += 1
        pointers[run + 1] = group
    return members[:group].copy(), counts[:group].copy(), pointers
