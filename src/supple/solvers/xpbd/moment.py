"""The arrays of a solver at one time, as the assessment of a frame reads them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Substep(NamedTuple):
    """Views of the solver's arrays, in its numbering.

    Attributes
    ----------
    points : (n, 4) positions about the origins of their components [m], and inverse masses [1/kg]
    velocities, origins : (n, 3) [m/s], [m]
    begun : (n, 3) positions where the substep began [m]
    time : of its end [s]; h : its length [s]
    """

    points: NDArray[np.float64]
    velocities: NDArray[np.float64]
    origins: NDArray[np.float64]
    begun: NDArray[np.float64]
    time: float
    h: float

    def world(self, rows: NDArray[np.integer] | slice = slice(None)) -> NDArray[np.float64]:
        """The positions of some vertices in the world, (k, 3) [m]."""
        if isinstance(rows, slice):
            return self.points[rows, :3] + self.origins[rows]
        # Several times as fast as an index.
        return self.points.take(rows, axis=0)[:, :3] + self.origins.take(rows, axis=0)


class Moment(NamedTuple):
    """Views of the solver's arrays, in its numbering.

    Attributes
    ----------
    points : (n, 4) positions about the origins of their components [m], and inverse masses [1/kg]
    extended : (n + a, 4) the same, and after them the anchors of stitches
    velocities, origins : (n, 3) [m/s], [m]; time : [s]
    """

    points: NDArray[np.float64]
    extended: NDArray[np.float64]
    velocities: NDArray[np.float64]
    origins: NDArray[np.float64]
    time: float
