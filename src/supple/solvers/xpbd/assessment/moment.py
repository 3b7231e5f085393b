"""The arrays of a solver at one time, as the assessment of a frame reads them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


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
