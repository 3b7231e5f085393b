"""Vertices of obstacles that bodies are stitched to: rows after those of the bodies, which no constraint moves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.model.system import System


class StitchAnchors:
    """The positions of a system's anchors in each substep, relative to the origin of the bodies stitched to them.

    Attributes
    ----------
    partners : (a,) a body's vertex that is stitched to each anchor; all such vertices have the same origin
    """

    def __init__(self, system: System) -> None:
        self.anchors = system.stitching.anchors
        self.first = system.stitching.body_vertices
        joins = system.stitching.joins()
        to_anchor = joins[joins[:, 1] >= self.first]
        self.partners = np.zeros(len(self.anchors), dtype=np.int32)
        self.partners[to_anchor[:, 1] - self.first] = to_anchor[:, 0]

    def place(self, rows: NDArray[np.float64], origins: NDArray[np.float64], time: float) -> None:
        """Write the positions at `time` [s] into the last of the rows (n + a, 3 or 4)."""
        if len(self.anchors):
            rows[self.first :, :3] = self.anchors.at(time) - origins[self.partners]

    def velocities(self, time: float, h: float) -> NDArray[np.float64]:
        """(a, 3) mean velocities over the h [s] before `time` [m/s]."""
        if not len(self.anchors):
            return np.zeros((0, 3))
        return (self.anchors.at(time) - self.anchors.at(time - h)) / h
