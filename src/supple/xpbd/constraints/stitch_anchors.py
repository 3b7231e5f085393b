"""Obstacles' vertices that bodies are stitched to: rows after those of the bodies, which no constraint can move."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.system import System


class StitchAnchors:
    """Where the anchors of a system are, substep by substep, relative to the origin of the bodies stitched to them.

    Attributes
    ----------
    fellows : (a,) a vertex of a body that each anchor is stitched to; all such vertices have the same origin
    """

    def __init__(self, system: System) -> None:
        self.anchors = system.stitching.anchors
        self.first = system.stitching.body_vertices
        joins = system.stitching.joins()
        to_anchor = joins[joins[:, 1] >= self.first]
        self.fellows = np.zeros(len(self.anchors), dtype=np.int32)
        self.fellows[to_anchor[:, 1] - self.first] = to_anchor[:, 0]

    def place(self, rows: NDArray[np.float64], origins: NDArray[np.float64], time: float) -> None:
        """Write where they are at `time` [s] into the last ones of rows (n + a, 3 or 4)."""
        if len(self.anchors):
            rows[self.first :, :3] = self.anchors.at(time) - origins[self.fellows]
