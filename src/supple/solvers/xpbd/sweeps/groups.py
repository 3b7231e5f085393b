"""Constraints in groups of independent ones, which a processor's vector units project together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.numerics.coloring import independent_groups
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.sweeps.ordering import Layout


@njit(forceinline=True)
def six(X, i):
    """The rows 0 to 5 of column i."""
    return X[0, i], X[1, i], X[2, i], X[3, i], X[4, i], X[5, i]


@njit(forceinline=True)
def nine(X, i):
    """The rows 0 to 8 of column i."""
    return X[0, i], X[1, i], X[2, i], X[3, i], X[4, i], X[5, i], X[6, i], X[7, i], X[8, i]


@njit(forceinline=True)
def twelve(X, i):
    """The rows 0 to 11 of column i."""
    return (
        X[0, i],
        X[1, i],
        X[2, i],
        X[3, i],
        X[4, i],
        X[5, i],
        X[6, i],
        X[7, i],
        X[8, i],
        X[9, i],
        X[10, i],
        X[11, i],
    )


@njit(forceinline=True)
def put_six(X, i, x):
    """Write the rows 0 to 5 of column i."""
    X[0, i], X[1, i], X[2, i], X[3, i], X[4, i], X[5, i] = x


@njit(forceinline=True)
def put_nine(X, i, x):
    """Write the first entries of x into the rows 0 to 8 of column i."""
    X[0, i], X[1, i], X[2, i], X[3, i], X[4, i] = x[0], x[1], x[2], x[3], x[4]
    X[5, i], X[6, i], X[7, i], X[8, i] = x[5], x[6], x[7], x[8]


@njit(forceinline=True)
def put_twelve(X, i, x):
    """Write the first entries of x into the rows 0 to 11 of column i."""
    X[0, i], X[1, i], X[2, i], X[3, i], X[4, i], X[5, i] = x[0], x[1], x[2], x[3], x[4], x[5]
    X[6, i], X[7, i], X[8, i], X[9, i], X[10, i], X[11, i] = x[6], x[7], x[8], x[9], x[10], x[11]


# No flag that assumes finite numbers (NaN must be detected) and none that reorders sums (same bits on any threads).
FLAGS = {"contract", "arcp", "nsz"}


# With this many lanes LLVM makes vector instructions; with 8 it unrolls the loop instead.
WIDTH = 16
# A group is formed from this many constraints in sequence, whose vertices fit into the first cache.
WINDOW = 1024


@dataclass(frozen=True, eq=False)
class Groups:
    """Groups of constraints without a common vertex.

    Attributes
    ----------
    members : (g, WIDTH) the constraints; unused lanes repeat the first
    counts : (g,) lanes in use
    pointers : (n_chunks + 1,) the groups of chunk c are pointers[c] .. pointers[c + 1]
    """

    members: NDArray[np.int64]
    counts: NDArray[np.int64]
    pointers: NDArray[np.int64]

    def lanes(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values of the constraints (m, c) as (g, c, WIDTH)."""
        return np.ascontiguousarray(values[self.members].transpose(0, 2, 1))


def make_groups(layout: Layout, constraints: NDArray[np.int32]) -> Groups:
    """The groups of constraints (m, k) on the vertices of a layout.

    No group has constraints of two bodies, so that the order of a body's constraints does not depend on other bodies.
    """
    order, chunk = layout.sort(constraints)
    body = layout.body[constraints[order, 0]]
    starts = np.flatnonzero((np.diff(chunk, prepend=-1) != 0) | (np.diff(body, prepend=-1) != 0))
    runs_of_chunks = np.searchsorted(chunk[starts], np.arange(layout.n_chunks + 1))
    return _grouped(constraints, order, np.append(starts, len(order)), runs_of_chunks, len(layout.rank))


def make_groups_of_one_chunk(constraints: NDArray[np.int32], pieces: NDArray[np.int32], n_vertices: int) -> Groups:
    """The groups of constraints (m, k) that one thread projects; no group has constraints of two pieces.

    Parameters
    ----------
    pieces : (n,) of the vertices; those above them (up to `n_vertices`) belong to the piece that they are joined to
    """
    of_vertex = np.append(pieces, np.full(n_vertices - len(pieces), np.iinfo(np.int32).max, dtype=np.int32))
    piece = of_vertex[constraints].min(axis=1, initial=np.iinfo(np.int32).max)
    order = np.argsort(piece, kind="stable")
    starts = np.flatnonzero(np.diff(piece[order], prepend=-1) != 0)
    return _grouped(constraints, order, np.append(starts, len(order)), np.array([0, len(starts)]), n_vertices)


def _grouped(
    constraints: NDArray[np.int32], order: NDArray, starts: NDArray, runs_of_chunks: NDArray, n_vertices: int
) -> Groups:
    ordered = np.ascontiguousarray(constraints[order], dtype=np.int32)
    members, counts, pointers = independent_groups(ordered, starts, n_vertices, WIDTH, WINDOW)
    return Groups(order[members], counts, pointers[runs_of_chunks])
