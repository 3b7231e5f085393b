"""Choosing between one thread and several, by the clock.

Threads that must meet forty times a frame help on a quiet machine, and hurt where another process has one of the
cores: a frame can then take ten times as long. Nobody can know beforehand; both ways give the same bits, so the
faster one is used.
"""

from __future__ import annotations

# How many frames the slower way rests before it is tried again; twice as many each time that it loses again.
SHORTEST_REST, LONGEST_REST = 30, 960
# Weight of a new measurement in the average of its way.
WEIGHT = 0.3


class Pace:
    """Remembers how long frames took either way.

    Parameters
    ----------
    choice : whether there is anything to choose; without it, `parallel` is always the answer.
    parallel : the way to begin with.
    """

    def __init__(self, choice: bool, parallel: bool) -> None:
        self.choice = choice
        self.parallel = parallel
        self._seconds: dict[bool, float] = {}
        self._started: set[bool] = set()
        self._rest = SHORTEST_REST
        self._rested = 0

    def choose(self) -> bool:
        """Whether the next frame should run on several threads."""
        if not self.choice or self.parallel not in self._seconds:
            return self.parallel
        other = not self.parallel
        return other if other not in self._seconds or self._rested >= self._rest else self.parallel

    def note(self, parallel: bool, seconds: float) -> None:
        """Learn how long a frame took."""
        if not self.choice:
            return
        if parallel not in self._started:
            self._started.add(parallel)  # the first frame of a way may have waited for the compiler
            return
        if parallel == self.parallel:
            before = self._seconds.get(parallel, seconds)
            self._seconds[parallel] = (1.0 - WEIGHT) * before + WEIGHT * seconds
            self._rested += 1
            return
        self._rested = 0
        self._seconds[parallel] = seconds
        if seconds < self._seconds[self.parallel]:
            self.parallel, self._rest = parallel, SHORTEST_REST
        else:
            self._rest = min(2 * self._rest, LONGEST_REST)
