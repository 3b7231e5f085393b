"""Whether scripts go straight within a step.

A step carries pins and obstacles to where they are at its end along straight lines. Where the script turns far in
between, as half a turn and more of an end does, the step is divided.
"""

from __future__ import annotations

import numpy as np

from supple.system import System

# How far off the straight line a script may go within a step, as a share of the smallest body's diagonal.
_OFF = 0.05

# The same for points of one pin against each other, as a share of the pin's own size: half a turn is 0.5. However thin
# what turns is, a turn is one.
_TURNED = 0.4

# Where a script is looked at. Not the middle alone: a full turn is back there, too. Nor simple fractions.
_AT = (0.2113, 0.5, 0.7265)


def bends(system: System, begin: float, end: float, diagonal: float) -> bool:
    """Whether some pin or obstacle goes far off the straight line between two times [s]; diagonal : [m]."""
    for pin in system.pins:
        if pin.motion is None:
            continue
        first, last = pin.targets(begin), pin.targets(end)
        size = float(np.linalg.norm(np.ptp(first, axis=0)))
        for share in _AT:
            off = pin.targets(begin + share * (end - begin)) - (first + share * (last - first))
            # Also along the line: a step may end where it began, and have been elsewhere.
            if float(np.abs(off).max(initial=0.0)) > _OFF * diagonal:
                return True
            among = off - off.mean(axis=0)
            if float(np.linalg.norm(among, axis=1).max(initial=0.0)) > _TURNED * size:
                return True
    return False
