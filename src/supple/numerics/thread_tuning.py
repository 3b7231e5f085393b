"""Choosing between one thread and several by measured time.

Threads that synchronize forty times a frame are faster on an idle machine. Where another process uses one of the
cores, a frame can take ten times as long. This cannot be predicted. Both modes give the same bits, so the faster one
is used. The unit that is timed is called a task here: a substep of XPBD, or a linear system of Newton's method.
"""

from __future__ import annotations

# After how many tasks the slower mode is measured again, for one task. The interval is doubled each time that the mode
# is still slower, up to a multiple of the shortest interval.
SHORTEST_INTERVAL, LARGEST_MULTIPLE = 400, 32
# Weight of a new measurement in the average of its mode.
WEIGHT = 0.1
# The present mode is changed where it becomes slower than the last measurement of the other mode by this factor.
TOLERATED_SLOWDOWN = 1.2


class ThreadTuner:
    """Chooses the faster of two modes, one thread or several, from measured times.

    Parameters
    ----------
    choice : whether there are two modes to choose from; otherwise `parallel` is always used.
    parallel : the mode to start with; interval : the shortest one between measurements of the slower mode, in tasks
    """

    def __init__(self, choice: bool, parallel: bool, interval: int = SHORTEST_INTERVAL) -> None:
        self.choice = choice
        self.parallel = parallel
        self._seconds: dict[bool, float] = {}
        self._compiled: set[bool] = set()
        self._shortest = self._interval = interval
        self._tasks = 0

    def choose(self) -> bool:
        """Whether the next task should run on several threads."""
        if not self.choice or self.parallel not in self._seconds:
            return self.parallel
        other = not self.parallel
        return other if other not in self._seconds or self._tasks >= self._interval else self.parallel

    def note(self, parallel: bool, seconds: float) -> None:
        """Take the measured time of a task into account."""
        if not self.choice:
            return
        if parallel not in self._compiled:
            self._compiled.add(parallel)  # the first task of a mode may include the compilation
            return
        other = not self.parallel
        if parallel == other:
            self._tasks = 0
            self._seconds[other] = seconds
            if seconds < self._seconds[self.parallel]:
                self._change(self._shortest)
            else:
                self._interval = min(2 * self._interval, LARGEST_MULTIPLE * self._shortest)
            return
        before = self._seconds.get(parallel, seconds)
        self._seconds[parallel] = (1.0 - WEIGHT) * before + WEIGHT * seconds
        self._tasks += 1
        if self._seconds[parallel] > TOLERATED_SLOWDOWN * self._seconds.get(other, float("inf")):
            self._change(self._interval)

    def _change(self, interval: int) -> None:
        self.parallel = not self.parallel
        self._interval, self._tasks = interval, 0
