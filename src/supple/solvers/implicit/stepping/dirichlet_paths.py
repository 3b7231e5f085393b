"""Whether scripts go straight within a step.

A step moves pins and obstacles to their places at its end along straight lines. Where the script turns far in between,
as half a turn and more of an end does, the step is divided.
"""

from __future__ import annotations

import numpy as np

from supple.model.system import System

# How far the points of one pin may go off the straight line against each other, as a share of the pin's own size.
# Half a turn is 0.5. The points of a thin pin that turns stay within the tolerance in metres.
_TURNED = 0.4

# The shares of the step at which a script is evaluated. Not the middle alone: a full turn is back there, too. Nor
# simple fractions, where several turns are back.
_AT = (0.2113, 0.5, 0.7265)


def turns(system: System, begin: float, end: float, tolerance: float) -> bool:
    """Whether some pin goes farther than `tolerance` [m] off the straight line between two times [s]."""
    for pin in system.pins:
        if pin.motion is None:
            continue
        first, last = pin.targets(begin), pin.targets(end)
        size = float(np.linalg.norm(np.ptp(first, axis=0)))
        for share in _AT:
            off = pin.targets(begin + share * (end - begin)) - (first + share * (last - first))
            # Also along the line: a script may leave a place and come back to it within a step.
            if float(np.abs(off).max(initial=0.0)) > tolerance:
                return True
            among = off - off.mean(axis=0)
            if float(np.linalg.norm(among, axis=1).max(initial=0.0)) > _TURNED * size:
                return True
    return False
