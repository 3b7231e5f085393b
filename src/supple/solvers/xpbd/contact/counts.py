"""What contact reports of a frame."""

import math
from dataclasses import dataclass


@dataclass
class RowCounts:
    """Counts over the substeps of a frame.

    Attributes
    ----------
    cut : substeps in which motion was shortened; crushed : those in which that could not help
    smallest : distance of a contact where a substep began [m]
    residual : the largest change in the last sweep over the rows of a substep, in gaps
    """

    cut: int = 0
    crushed: int = 0
    smallest: float = math.inf
    residual: float = 0.0
