"""Whether scripts go straight within a step.

A step carries pins and obstacles to where they are at its end along straight lines. Where the script turns far in
between, as half a turn and more of an end does, the step is divided.
"""

from __future__ import annotations

import numpy as np

from supple.system import System

# How far off the straight line a script may go within a step, as a share of the smallest body's diagonal.
_OFF = 0.05

# Where a script is looked at. Not the middle alone: a full turn is back there, too.
_AT = (0.21, 0.5, 0.73)


def bends(system: System, begin: float, end: float, diagonal: float) -> bool:
    """Whether some pin or obstacle goes far off the straight line between two times [s]; diagonal : [m]."""
    for pin in system.pins:
        if pin.motion is None:
            continue
        first, last = pin.targets(begin), pin.targets(end)
        for share in _AT:
            off = pin.targets(begin + share * (end - begin)) - (first + share * (last - first))
            # Also along the line: a step may end where it began, and have been elsewhere.
            if float(np.abs(off).max(initial=0.0)) > _OFF * diagonal:
                return True
    return False
