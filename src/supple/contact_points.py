"""Contacts as arrays, to draw them or to add up their forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class ContactPoints:
    """All contacts of one frame.

    Attributes
    ----------
    points : (k, 3) midpoints between the two nearest points [m]
    normals : (k, 3) unit vectors from the second to the first
    forces : (k, 3) on the first, along the normal [N]; the force on the second is opposite
    distances : (k,) [m]
    first, second : (k,) the two bodies or obstacles: indices into `names`
    names : of all bodies, and after them of all obstacles
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    forces: NDArray[np.float64]
    distances: NDArray[np.float64]
    first: NDArray[np.int32]
    second: NDArray[np.int32]
    names: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.points)

    def force_between(self, on: str, by: str) -> NDArray[np.float64]:
        """(3,) the total normal force on one body or obstacle by another [N]."""
        a, b = self.names.index(on), self.names.index(by)
        forward = self.forces[(self.first == a) & (self.second == b)].sum(axis=0)
        backward = self.forces[(self.first == b) & (self.second == a)].sum(axis=0)
        return np.asarray(forward - backward)
