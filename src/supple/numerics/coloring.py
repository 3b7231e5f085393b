"""Which constraints may be projected at the same time, and in which order one thread should project them.

Two constraints are independent where they share no vertex. `breadth_first_order` divides the vertices of a mesh
into levels such that a constraint has vertices of at most two neighbouring levels; `greedy_colors` finds independent
constraints near each other.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.numerics.kernel_cache import njit

MAX_COLORS = 256


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
    order = np.empty(n, np.int32)
    levels = np.full(n, -1, np.int32)
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
def greedy_colors(constraints, n_vertices, block):
    """Color each run of `block` constraints separately, such that constraints of one color share no vertex.

    Every constraint gets the first color that none of its vertices has in its block. Beyond `MAX_COLORS` the last color
    is shared. Therefore these colors only order constraints; they do not guarantee independence.

    Parameters
    ----------
    constraints : (m, k) int32 vertex indices
    n_vertices : number of vertices
    block : length of the runs

    Returns
    -------
    (m,) int32 colors.
    """
    m, k = constraints.shape
    colors = np.zeros(m, np.int32)
    words = MAX_COLORS // 64
    used = np.zeros((n_vertices, words), np.uint64)
    stamp = np.full(n_vertices, -1, np.int64)
    one = np.uint64(1)
    for c in range(m):
        run = c // block
        for a in range(k):
            i = constraints[c, a]
            if stamp[i] != run:
                stamp[i] = run
                for word in range(words):
                    used[i, word] = 0
        color = MAX_COLORS - 1
        for word in range(words):
            taken = np.uint64(0)
            for a in range(k):
                taken |= used[constraints[c, a], word]
            if taken != ~np.uint64(0):
                bit = 0
                while (taken >> np.uint64(bit)) & one:
                    bit += 1
                color = 64 * word + bit
                break
        colors[c] = color
        for a in range(k):
            used[constraints[c, a], color // 64] |= one << np.uint64(color % 64)
    return colors
