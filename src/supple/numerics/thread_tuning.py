"""Choosing between one thread and several, by the clock.

Threads that must meet forty times a frame help on a quiet machine, and hurt where another process has one of the
cores: a frame can then take ten times as long. Nobody can know beforehand; both ways give the same bits, so the
faster one is used. What is timed is called a turn here: a substep of XPBD, a linear system of Newton's method.
"""

from __future__ import annotations

# How many turns the slower way rests before it is tried again, for one turn; twice as many each time that it loses, up
# to so many times the shortest rest.
SHORTEST_REST, LONGEST = 400, 32
# Weight of a new measurement in the average of its way.
WEIGHT = 0.1
# How much slower than the other way was the present one may become before they change places.
PATIENCE = 1.2


class Pace:
    """Remembers how long turns took either way.

    Parameters
    ----------
    choice : whether there is anything to choose; without it, `parallel` is always the answer.
    parallel : the way to begin with; rest : the shortest one of the slower way, in turns
    """

    def __init__(self, choice: bool, parallel: bool, rest: int = SHORTEST_REST) -> None:
        self.choice = choice
        self.parallel = parallel
        self._seconds: dict[bool, float] = {}
        self._started: set[bool] = set()
        self._shortest = self._rest = rest
        self._rested = 0

    def choose(self) -> bool:
        """Whether the next turn should run on several threads."""
        if not self.choice or self.parallel not in self._seconds:
            return self.parallel
        other = not self.parallel
        return other if other not in self._seconds or self._rested >= self._rest else self.parallel

    def note(self, parallel: bool, seconds: float) -> None:
        """Learn how long a turn took."""
        if not self.choice:
            return
        if parallel not in self._started:
            self._started.add(parallel)  # the first one of a way may have waited for the compiler
            return
        other = not self.parallel
        if parallel == other:
            self._rested = 0
            self._seconds[other] = seconds
            if seconds < self._seconds[self.parallel]:
                self._change(self._shortest)
            else:
                self._rest = min(2 * self._rest, LONGEST * self._shortest)
            return
        before = self._seconds.get(parallel, seconds)
        self._seconds[parallel] = (1.0 - WEIGHT) * before + WEIGHT * seconds
        self._rested += 1
        if self._seconds[parallel] > PATIENCE * self._seconds.get(other, float("inf")):
            self._change(self._rest)

    def _change(self, rest: int) -> None:
        self.parallel = not self.parallel
        self._rest, self._rested = rest, 0
