"""The contacts of surfaces as rows of arrays.

A row keeps a gap: n . r >= offset, with r = sum c_i x_i over four points (see `impulses`). Its impulse in total is a
push along n and friction perpendicular to n. A substep begins with the force that was kept of the substep before. It is
applied to the prediction, before the elastic constraints, so that these see the load that contact transmits. After
them, sweeps change the impulse by what is missing, or too much, as long as the push remains zero or more. They may be
repeated in a substep. At its end, the share of the force that the next one begins with is kept. Without this memory,
the force that a light body transmits in a substep is limited by the mass of its surface.

Source: Catto, "Iterative Dynamics with Temporal Coherence" (2005), sections 5 and 6 (accumulated impulses, warm
starting).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.numerics.mat3 import row
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.contact.impulses import apply_impulse
from supple.solvers.xpbd.contact.response_rates import keep_shares


class LoadedRows(NamedTuple):
    """Rows that hold a force; see `ContactRows`."""

    keys: NDArray[np.int64]
    vertices: NDArray[np.int32]
    weights: NDArray[np.float64]
    normals: NDArray[np.float64]
    offsets: NDArray[np.float64]
    friction: NDArray[np.float64]
    forces: NDArray[np.float64]

    def chosen(self, kept: NDArray[np.bool_]) -> LoadedRows:
        """Those rows (of k,) that are kept."""
        return LoadedRows._make(values[kept] for values in self)

    def joined(self, other: LoadedRows) -> LoadedRows:
        """The rows of both, whose keys differ, in the order of the keys."""
        if not len(other.keys):
            return self
        order = np.argsort(np.concatenate([self.keys, other.keys]))
        return LoadedRows._make(np.concatenate(both)[order] for both in zip(self, other, strict=True))

    @staticmethod
    def none() -> LoadedRows:
        return LoadedRows(
            np.zeros(0, dtype=np.int64),
            np.zeros((0, 4), dtype=np.int32),
            np.zeros((0, 4)),
            np.zeros((0, 3)),
            np.zeros(0),
            np.zeros(0),
            np.zeros((0, 3)),
        )


class ContactRows:
    """Rows for every pair that may touch. A row that keeps its pair keeps its force, also when lists are renewed.

    Attributes
    ----------
    keys : (k,) what identifies the pair of each row, ascending
    vertices : (k, 4); weights : (k, 4); normals : (k, 3); offsets : (k,) gap that is kept [m]; friction : (k,)
    forces : (k, 3) [N] on the first side, the mean over the substep; shares : (k,) what the next substep keeps of them
    loads : whether any row may hold a force
    active : (k,) whether the pair is near in this substep: it touches, or holds a force
    deep : (k,) whether the first vertex may be inside the piece of the others
    """

    def __init__(self) -> None:
        self.resize(np.zeros(0, dtype=np.int64))

    def resize(self, keys: NDArray[np.int64]) -> None:
        """Rows without forces, for these pairs."""
        k = len(keys)
        self.keys, self.loads = keys, False
        self.vertices, self.weights = np.zeros((k, 4), dtype=np.int32), np.zeros((k, 4))
        self.normals, self.offsets, self.friction = np.zeros((k, 3)), np.zeros(k), np.zeros(k)
        self.forces, self.shares = np.zeros((k, 3)), np.zeros(k)
        self.active, self.deep = np.zeros(k, dtype=np.bool_), np.zeros(k, dtype=np.bool_)
        # As kernels receive them.
        self.described = (
            self.vertices,
            self.weights,
            self.normals,
            self.offsets,
            self.friction,
            self.forces,
            self.shares,
            self.active,
            self.deep,
        )

    def renew(self, keys: NDArray[np.int64]) -> None:
        """Rows for these pairs (ascending) and for all that hold a force; these keep it."""
        self.restore(self.loaded(), keys)

    def restore(self, loaded: LoadedRows, keys: NDArray[np.int64]) -> None:
        """Rows for these pairs (ascending), and those of `loaded`."""
        new = loaded.keys[~_among(loaded.keys, keys)]
        self.resize(np.sort(np.concatenate([keys, new])) if len(new) else keys)
        place = np.searchsorted(self.keys, loaded.keys)
        for name in ("vertices", "weights", "normals", "offsets", "friction", "forces"):
            getattr(self, name)[place] = getattr(loaded, name)
        self.loads = len(place) > 0

    def keep(self) -> None:
        """End a substep: the next one begins with a share of the forces."""
        self.loads = len(self.keys) > 0 and keep_shares(self.forces, self.shares)

    def loaded(self) -> LoadedRows:
        """Copies of all rows that hold a force."""
        k = loaded_rows(self.forces)
        return LoadedRows(
            self.keys[k],
            self.vertices[k],
            self.weights[k],
            self.normals[k],
            self.offsets[k],
            self.friction[k],
            self.forces[k],
        )


def _among(few: NDArray[np.int64], keys: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which of a few numbers are among `keys` (k,), ascending."""
    if not len(keys):
        return np.zeros(len(few), dtype=np.bool_)
    return keys[np.minimum(np.searchsorted(keys, few), len(keys) - 1)] == few


def loaded_rows(forces: NDArray[np.float64]) -> NDArray[np.int64]:
    """The rows that hold a force (k, 3), ascending."""
    # `any` over an axis of three takes half as long again.
    return np.flatnonzero((forces[:, 0] != 0.0) | (forces[:, 1] != 0.0) | (forces[:, 2] != 0.0))


@njit(cache=True)
def choose_rows(x, x_prev, movers, rows, first_obstacle, kind, h):
    """The active rows of one kind: with triangles and edges of bodies (0), or of obstacles (1).

    A row that is not active and holds a force has lost its pair: its impulse is taken back.

    Parameters
    ----------
    x, x_prev, movers, h : see `push_rows`
    rows : `ContactRows.described`; first_obstacle : the first point of an obstacle
    """
    vertices, weights, _, _, _, forces, _, active, _ = rows
    chosen = np.zeros(len(active), dtype=np.int64)
    count = 0
    for e in range(len(active)):
        if (vertices[e, 3] >= first_obstacle) != (kind == 1):
            continue
        if active[e]:
            chosen[count] = e
            count += 1
        elif forces[e, 0] != 0.0 or forces[e, 1] != 0.0 or forces[e, 2] != 0.0:
            d = (-h * h * forces[e, 0], -h * h * forces[e, 1], -h * h * forces[e, 2])
            apply_impulse(x, x_prev, movers, vertices, weights, e, d)
            forces[e, :] = 0.0
    return chosen[:count]


@njit(cache=True)
def push_rows(x, x_prev, movers, rows, h):
    """Apply the forces of the substep before to the prediction x (n, 3), as impulses of this substep.

    Parameters
    ----------
    x, x_prev : (n, 3) prediction, and positions at the beginning of the substep [m]
    movers : of the points, see `Movers`
    rows : `ContactRows.described`
    h : length of the substep [s]
    """
    vertices, weights, _, _, _, forces, _, _, _ = rows
    for e in range(len(forces)):
        f = row(forces, e)
        if f[0] != 0.0 or f[1] != 0.0 or f[2] != 0.0:
            d = (h * h * f[0], h * h * f[1], h * h * f[2])
            apply_impulse(x, x_prev, movers, vertices, weights, e, d)
