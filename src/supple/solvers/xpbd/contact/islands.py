"""Islands: pieces that rows connect. Each is solved to its own end, so that what is far away changes nothing here.

A piece is what meshes, stitches, welds and joints connect. Nodes that cannot move connect nothing.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.runtime.kernel_cache import njit


class Islands(NamedTuple):
    """The islands of the present rows, for kernels; scratch memory but for the pieces.

    Attributes
    ----------
    piece : (N,) of each node, -1 for those of obstacles; rigid : (p,) whether a rigid body is in a piece
    root : (p,) the piece that stands for the island of each one; the next are of islands, in the rows of these
    stiff : (p,) whether a rigid body is in it; active : (p,) whether it is swept; swept : (p,) within a solution
    residual, changes : (p,) what the last sweep over its rows changed, in gaps and [m]; least : (p,) J of its tets
    """

    piece: NDArray[np.int32]
    rigid: NDArray[np.bool_]
    root: NDArray[np.int32]
    stiff: NDArray[np.bool_]
    active: NDArray[np.bool_]
    swept: NDArray[np.bool_]
    residual: NDArray[np.float64]
    changes: NDArray[np.float64]
    least: NDArray[np.float64]

    @classmethod
    def of(cls, piece: NDArray[np.int32], rigid: NDArray[np.int32]) -> Islands:
        """Of the pieces of nodes (N,), some of which are `rigid` bodies' (k,)."""
        count = int(piece.max(initial=-1)) + 1
        has_rigid = np.zeros(count, dtype=np.bool_)
        has_rigid[rigid] = True
        root, flags, numbers = np.zeros(count, np.int32), np.zeros((3, count), np.bool_), np.zeros((3, count))
        return cls(piece, has_rigid, root, flags[0], flags[1], flags[2], numbers[0], numbers[1], numbers[2])


@njit
def _root(root, p):
    while root[p] != p:
        root[p] = root[root[p]]
        p = root[p]
    return p


@njit
def island_of(points, rows, e, islands):
    """The island of a row; -1 where none of its nodes can move."""
    for i in range(4):
        v = rows.nodes[e, i]
        if points[v, 3] > 0.0 and islands.piece[v] >= 0:
            return islands.root[islands.piece[v]]
    return -1


@njit(cache=True)
def find_islands(points, rows, count, islands):
    """Set the islands of the first `count` rows; all of them are active."""
    root = islands.root
    for p in range(len(root)):
        root[p] = p
    for e in range(count):
        if rows.masses[e] == 0.0:
            continue
        first = -1
        for i in range(4):
            v = rows.nodes[e, i]
            if points[v, 3] == 0.0 or islands.piece[v] < 0:
                continue
            p = _root(root, islands.piece[v])
            if first < 0:
                first = p
            elif p < first:
                root[first] = p
                first = p
            else:
                root[p] = first
    islands.stiff[:] = False
    for p in range(len(root)):
        root[p] = _root(root, p)
        islands.stiff[root[p]] |= islands.rigid[p]
    islands.active[:] = True


@njit(cache=True)
def keep_active(tets, low, islands, changes, flat, first):
    """Leave those islands active that have a tet among the first `low` of `tets.low`.

    Or, unless it is the `first` time, whose last sweep changed more than `changes` gaps with a J of at most `flat`.
    Returns whether any is active.
    """
    islands.least[:] = np.inf
    islands.swept[:] = False
    for t in range(len(tets.nodes)):
        p = islands.root[islands.piece[tets.nodes[t, 0]]]
        islands.least[p] = min(islands.least[p], tets.now[t])
    for k in range(low):
        islands.swept[islands.root[islands.piece[tets.nodes[tets.low[k], 0]]]] = True
    some = False
    for p in range(len(islands.root)):
        if islands.root[p] != p:
            continue
        unsettled = not first and islands.residual[p] > changes and islands.least[p] <= flat
        islands.active[p] = islands.active[p] and (islands.swept[p] or unsettled)
        some = some or islands.active[p]
    return some
