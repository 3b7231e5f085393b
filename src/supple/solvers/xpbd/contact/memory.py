"""What contact needs of the frame before, beside positions and velocities. It is stored in `State.memory`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class ContactMemory:
    """The forces with which the next frame begins, of pairs that push.

    Attributes
    ----------
    keys : (k,) the pairs, see `Pairs`; forces : (k, 3) on their first side [N]; normals : (k, 3)
    positions : (n, 3) of the vertices at the end of that frame [m]
    """

    keys: NDArray[np.int64]
    forces: NDArray[np.float64]
    normals: NDArray[np.float64]
    positions: NDArray[np.float64]

    def belongs_to(self, positions: NDArray[np.float64], tolerance: float) -> bool:
        """Whether every vertex is where it was, up to a tolerance [m]. Obstacles may be others."""
        return positions.shape == self.positions.shape and bool((np.abs(positions - self.positions) <= tolerance).all())
