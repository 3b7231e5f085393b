"""What contact needs of the frame before, beside positions and velocities. It is stored in `State.memory`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class ListMemory:
    """The pairs that may touch, and what they hold for, in the numbering of the solver.

    Attributes
    ----------
    keys, reached : (k,) see `PAIR` [m]
    x, v : (N, 3) where nodes were and how fast, when the list began [m], [m/s]
    age, until : the time since then, and how long the list holds [s]; margin : how far nodes may be from there [m]
    collide : (p, p) which things could touch; on_shapes : (p, s) which of them simple shapes
    shapes : (s, ...) the frames and numbers of these, one row each
    excluded : number of pairs of parts that do not collide since they are joined
    """

    keys: NDArray[np.int64]
    reached: NDArray[np.float64]
    x: NDArray[np.float64]
    v: NDArray[np.float64]
    age: float
    until: float
    margin: float
    collide: NDArray[np.bool_]
    on_shapes: NDArray[np.bool_]
    shapes: NDArray[np.float64]
    excluded: int


@dataclass(frozen=True, eq=False)
class ContactMemory:
    """The forces with which the next frame begins, of pairs that push.

    Attributes
    ----------
    keys : (k,) the pairs, see `PAIR`; forces : (k, 3) on their first side [N]; normals : (k, 3)
    positions : (n, 3) of the vertices at the end of that frame [m]
    lists : which pairs may touch; None where none may
    """

    keys: NDArray[np.int64]
    forces: NDArray[np.float64]
    normals: NDArray[np.float64]
    positions: NDArray[np.float64]
    lists: ListMemory | None

    def belongs_to(self, positions: NDArray[np.float64], tolerance: float) -> bool:
        """Whether every vertex is where it was, up to a tolerance [m]. Obstacles may be others."""
        return positions.shape == self.positions.shape and bool((np.abs(positions - self.positions) <= tolerance).all())
