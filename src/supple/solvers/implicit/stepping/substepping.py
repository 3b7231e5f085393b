"""The substeps of a step: pieces in which scripts go straight, and halves of them where a substep fails.

Everything is counted in units of the shortest substep that is possible, of which a step has a power of two.
"""

from __future__ import annotations

from dataclasses import dataclass

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


# A script that never goes straight, such as one that jumps, is followed in at most this many pieces of the step. With
# less than half a turn in each, that follows up to 500 turns in a step.
_MOST_PIECES = 1024


@dataclass(eq=False)
class Substepping:
    """The substeps of a step of dt [s] from `begin` [s].

    Attributes
    ----------
    tolerance : how far a script may go off the straight line within a piece [m]
    halves : a power of two, the number of substeps that one piece may take
    done, size : units that are behind, and that the next substep takes; piece : (first, last) unit of the present piece
    """

    system: System
    begin: float
    dt: float
    tolerance: float
    halves: int
    done: int = 0
    size: int = 0
    piece: tuple[int, int] = (0, 0)

    @classmethod
    def of(cls, system: System, begin: float, dt: float, tolerance: float, max_substeps: int) -> Substepping:
        """A step each of whose pieces may take `max_substeps` substeps."""
        substepping = cls(system, begin, dt, tolerance, 1 << (int(max_substeps).bit_length() - 1))
        substepping._find_piece()
        return substepping

    @property
    def units(self) -> int:
        return self.halves * _MOST_PIECES if self.halves > 1 else 1

    @property
    def over(self) -> bool:
        return self.done >= self.units

    @property
    def end(self) -> float:
        """Time at the end of the next substep [s]."""
        return self.time(self.done + self.size)

    @property
    def length(self) -> float:
        """Of the next substep [s]."""
        return self.dt * (self.size / self.units)

    def time(self, unit: int) -> float:
        return self.begin + self.dt * (unit / self.units)

    def halve(self) -> bool:
        """Make the next substep half as long; False where it may not be shorter."""
        first, last = self.piece
        if self.size * self.halves <= last - first:
            return False
        self.size //= 2
        return True

    def advance(self) -> None:
        """After a substep: the next one is twice as long where that fits the piece."""
        self.done += self.size
        first, last = self.piece
        if self.done == last:
            if not self.over:
                self._find_piece()
            return
        while (self.done - first) % (2 * self.size) == 0 and self.done + 2 * self.size <= last:
            self.size *= 2

    def _find_piece(self) -> None:
        """The longest straight piece from here on, of those that repeated halving of the step gives."""
        size = self.done & -self.done or self.units
        begin = self.time(self.done)
        while size > self.halves and turns(self.system, begin, self.time(self.done + size), self.tolerance):
            size //= 2
        self.piece, self.size = (self.done, self.done + size), size
