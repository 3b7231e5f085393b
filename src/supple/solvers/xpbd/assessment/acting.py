"""Forces on vertices, and their works over the substeps of a frame."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from supple.model.energy_balance import add_works
from supple.runtime.kernel_cache import njit

Floats = NDArray[np.float64]


class Acting:
    """Forces of several kinds or places, each on vertices and anchors of its own.

    Parameters
    ----------
    names : the names of their works, (k,)
    vertices : (k,) of arrays, in the solver's numbering

    Attributes
    ----------
    rows : (r,) those vertices, one force after the other; start : (k + 1,) where each begins
    forces : (r, 3) of the present substep [N]
    parts : of each force, its rows and its part of the above, which is a view
    works : (k,) so far in the frame [J]
    """

    def __init__(self, names: Sequence[str], vertices: Sequence[NDArray[np.integer]]) -> None:
        self.names = names
        self.start = np.cumsum([0, *map(len, vertices)]).astype(np.int64)
        self.rows = np.concatenate([np.zeros(0, dtype=np.int64), *vertices]).astype(np.int64)
        self.forces, self.works = np.zeros((len(self.rows), 3)), np.zeros(len(names))
        ends = zip(self.start[:-1], self.start[1:], strict=True)
        self.parts = [(self.rows[first:last], self.forces[first:last]) for first, last in ends]

    def end_substep(self, points: Floats, begun: Floats, total: Floats) -> None:
        """Add the works from `begun` to `points` (n, >= 3) [m], and the forces to `total` (n, 3) [N]."""
        _end_substep(self.rows, self.start, self.forces, self.works, points, begun, total)

    def add_works(self, works: dict[str, float]) -> None:
        """Add the works of the frame to those by name [J]."""
        for name, work in zip(self.names, self.works.tolist(), strict=True):
            add_works(works, {name: work})


@njit(cache=True)
def _end_substep(rows, start, forces, works, points, begun, total):
    for f in range(len(works)):
        work = 0.0
        for k in range(start[f], start[f + 1]):
            i = rows[k]
            for j in range(3):
                work += forces[k, j] * (points[i, j] - begun[i, j])
                total[i, j] += forces[k, j]
        works[f] += work
