"""How a step is divided: into pieces that scripts ask for, and those into halves where a substep fails.

Everything is counted in units of the shortest substep that there may be, of which a step has a power of two.
"""

from __future__ import annotations

from dataclasses import dataclass

from supple.implicit.stepping.dirichlet_paths import bends
from supple.system import System

# A script that never goes straight, one that jumps for instance, is followed in at most so many pieces of the step.
_MOST_PIECES = 1024


@dataclass(eq=False)
class Division:
    """The substeps of a step of dt [s] from `begin` [s].

    Attributes
    ----------
    diagonal : of the smallest body [m]; halves : a power of two, how many substeps one piece may take
    done, size : units that are behind, and that the next substep takes; piece : (first, last) unit of the piece now
    """

    system: System
    begin: float
    dt: float
    diagonal: float
    halves: int
    done: int = 0
    size: int = 0
    piece: tuple[int, int] = (0, 0)

    @classmethod
    def of(cls, system: System, begin: float, dt: float, diagonal: float, max_substeps: int) -> Division:
        """A step whose pieces may take so many substeps each."""
        division = cls(system, begin, dt, diagonal, 1 << (int(max_substeps).bit_length() - 1))
        division._find_piece()
        return division

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
        """The substep has been taken: the next is longer again where it can be."""
        self.done += self.size
        first, last = self.piece
        if self.done == last:
            if not self.over:
                self._find_piece()
            return
        while (self.done - first) % (2 * self.size) == 0 and self.done + 2 * self.size <= last:
            self.size *= 2

    def _find_piece(self) -> None:
        """The longest straight piece from here on, of those that halving the step again and again gives."""
        size = self.done & -self.done or self.units
        begin = self.time(self.done)
        while size > self.halves and bends(self.system, begin, self.time(self.done + size), self.diagonal):
            size //= 2
        self.piece, self.size = (self.done, self.done + size), size
