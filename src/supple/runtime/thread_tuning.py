"""Choosing between one thread and several by measured time.

Threads that synchronize forty times a frame are faster on an idle machine. Where another process uses one of the
cores, a frame can take ten times as long. This cannot be predicted. Both modes give the same bits, so the faster one
is used. The unit that is timed is called a task here: a substep of XPBD, or an iteration of Newton's method.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from contextlib import AbstractContextManager
from statistics import median
from time import perf_counter

from supple.runtime.interruption import interruption_point
from supple.runtime.threads import numba_threads, one_thread

# After how many tasks the slower mode is measured again. The interval is doubled each time that the mode
# is still slower, up to a multiple of the shortest interval.
SHORTEST_INTERVAL, LARGEST_MULTIPLE = 400, 32
# A mode is as fast as the median of its latest tasks: one of them may include a compilation, or have been interrupted.
SAMPLES = 3
# The current mode is changed where it becomes slower than the latest tasks of the other mode by this factor.
TOLERATED_SLOWDOWN = 1.2


class ThreadTuner:
    """Chooses the faster of two modes, one thread or several, from measured times.

    Parameters
    ----------
    choice : whether there are two modes to choose from; otherwise `parallel` is always used.
    parallel : the mode to start with; interval : the shortest one between measurements of the slower mode, in tasks

    Attributes
    ----------
    untimed : seconds of the current task that do not count, since that part of the work varies from task to task
    """

    def __init__(self, choice: bool, parallel: bool, interval: int = SHORTEST_INTERVAL) -> None:
        self.choice = choice
        self.parallel = parallel
        self.untimed = 0.0
        self._seconds = {mode: deque[float](maxlen=SAMPLES) for mode in (False, True)}
        self._compiled: set[bool] = set()
        self._shortest = self._interval = interval
        self._tasks = 0
        self._left = SAMPLES  # tasks of the other mode that remain to be measured

    def choose(self) -> bool:
        """Whether the next task should run on several threads."""
        measured = self.choice and len(self._seconds[self.parallel]) == SAMPLES
        return self.parallel ^ (measured and self._left > 0)

    def note(self, parallel: bool, seconds: float) -> None:
        """Take the measured time of a task into account."""
        if not self.choice:
            return
        if parallel not in self._compiled:
            self._compiled.add(parallel)  # the first task of a mode may include the compilation
            return
        self._seconds[parallel].append(seconds)
        if parallel == self.parallel:
            self._tasks += 1
            if self._left == 0 and self._time(parallel) > TOLERATED_SLOWDOWN * self._time(not parallel):
                self._change(self._interval)
            elif self._tasks >= self._interval:
                self._left = SAMPLES
            return
        self._left -= 1
        if self._left > 0:
            return
        self._tasks = 0
        if self._time(parallel) < self._time(not parallel):
            self._change(self._shortest)
        else:
            self._interval = min(2 * self._interval, LARGEST_MULTIPLE * self._shortest)

    def threads(self, parallel: bool, threads: int | None = None) -> AbstractContextManager[None]:
        """Run parallel kernels on this many threads (None: as many as there are), or on one.

        Where there is a choice, they have their parallel form on one thread too, so that none is compiled twice.
        """
        if parallel:
            return numba_threads(threads)
        return one_thread() if self.choice else numba_threads(1)

    def tasks(self, count: int, threads: int) -> Iterator[int]:
        """The numbers of this many tasks, each on several threads or on one; their times are noted.

        A task takes 1 or `threads` threads for all of its kernels: where another process is busy, each kernel that
        waits for a second thread takes many times longer. It can be interrupted before each task.
        """
        for k in range(count):
            interruption_point()
            parallel, started = self.choose(), perf_counter()
            self.untimed = 0.0
            with self.threads(parallel, threads):
                yield k
            self.note(parallel, perf_counter() - started - self.untimed)

    def _time(self, mode: bool) -> float:
        return median(self._seconds[mode])

    def _change(self, interval: int) -> None:
        self.parallel = not self.parallel
        self._interval, self._tasks = interval, 0
