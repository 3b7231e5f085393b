"""The substeps of a step: pieces in which scripts go straight, and halves of them where a substep fails.

All are the step divided by a power of two.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from supple.model.system import System

# Whether scripts go straight within a step.
#
# A step moves pins and obstacles to their places at its end along straight lines. Where the script turns far in
# between, as half a turn and more of an end does, the step is divided.


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


# A script that never goes straight, such as one that jumps, is followed in pieces no shorter than this share of
# the step. With less than half a turn in each, that follows up to 500 turns in a step.
_SHORTEST_PIECE = 1.0 / 1024.0


@dataclass(eq=False)
class Substepping:
    """The substeps of a step of dt [s] from `begin` [s].

    Attributes
    ----------
    tolerance : how far a script may go off the straight line within a piece [m]
    halves : a power of two, the number of substeps that one piece may take
    ahead : what is left of the step, the next substep last: where each begins and ends, and how short it may become, 0
        where it may still be divided into pieces; all as shares of the step
    """

    system: System
    begin: float
    dt: float
    tolerance: float
    halves: int
    ahead: list[tuple[float, float, float]] = field(default_factory=lambda: [(0.0, 1.0, 0.0)])

    @classmethod
    def of(cls, system: System, begin: float, dt: float, tolerance: float, max_substeps: int) -> Substepping:
        """A step each of whose pieces may take `max_substeps` substeps."""
        substepping = cls(system, begin, dt, tolerance, 1 << (int(max_substeps).bit_length() - 1))
        substepping._find_piece()
        return substepping

    @property
    def over(self) -> bool:
        return not self.ahead

    @property
    def end(self) -> float:
        """Time at the end of the next substep [s]."""
        return self.begin + self.dt * self.ahead[-1][1]

    @property
    def divisible(self) -> bool:
        """Whether the next substep may be shorter."""
        return self.ahead[-1][1] - self.ahead[-1][0] > self.ahead[-1][2]

    @property
    def length(self) -> float:
        """Of the next substep [s]."""
        first, last, _ = self.ahead[-1]
        return self.dt * (last - first)

    def halve(self) -> bool:
        """Make the next substep half as long; False where it may not be shorter."""
        first, last, shortest = self.ahead[-1]
        if not self.divisible:
            return False
        middle = 0.5 * (first + last)
        self.ahead[-1:] = [(middle, last, shortest), (first, middle, shortest)]
        return True

    def divide(self) -> bool:
        """As `halve`, for a step that is longer than the things: its halves are pieces of their own."""
        first, last, _ = self.ahead[-1]
        if self.halves == 1 or last - first <= _SHORTEST_PIECE:
            return self.halve()
        self.ahead[-1] = first, last, 0.0
        self.halve()
        self._find_piece()
        return True

    def advance(self) -> None:
        """After a substep: the next one is as long as what is left of those that were halved."""
        self.ahead.pop()
        self._find_piece()

    def _find_piece(self) -> None:
        """Halve what comes next until it is a straight piece, if it is not known to be one."""
        while self.ahead and self.ahead[-1][2] == 0.0:
            first, last, _ = self.ahead[-1]
            begin, end = self.begin + self.dt * first, self.end
            divisible = self.halves > 1 and last - first > _SHORTEST_PIECE
            if divisible and turns(self.system, begin, end, self.tolerance):
                self.halve()
            else:
                self.ahead[-1] = first, last, (last - first) / self.halves
