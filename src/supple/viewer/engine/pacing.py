"""Simulated time against the clock: when the next frame is due, and whether frames come in time."""

from __future__ import annotations

from collections import deque

from supple.viewer.protocol.snapshots import Timing

# What is measured looks back this far [s].
WINDOW = 1.0
# Slower than the speed that was asked for by more than this share is said to be late.
TOLERANCE = 0.1


class Pacing:
    """The clock of a running simulation. All times are those of `time.perf_counter` [s]."""

    def __init__(self) -> None:
        self.due = 0.0
        self._begun = 0.0
        self._steps: deque[tuple[float, float, float]] = deque()

    def start(self, now: float) -> None:
        """Time begins to run, or runs at another speed from now on."""
        self.due = self._begun = now
        self._steps.clear()

    def stepped(self, now: float, seconds: float, dt: float, speed: float) -> None:
        """A step of `dt` [s] has been simulated, in `seconds` of wall-clock time."""
        self._steps.append((now, seconds, dt))
        while self._steps[0][0] < now - WINDOW and len(self._steps) > 2:
            self._steps.popleft()
        # A step that came late is made up for only by one: nobody wants to see a film run faster after a pause.
        self.due = max(self.due + dt / speed, now - dt / speed)

    def timing(self, now: float, speed: float, playing: bool) -> Timing:
        """How fast it has been lately."""
        if not self._steps:
            return Timing()
        step_ms = 1e3 * sum(seconds for _, seconds, _ in self._steps) / len(self._steps)
        if not playing:
            return Timing(step_ms=step_ms)
        span = now - max(self._begun, self._steps[0][0] - self._steps[0][1])
        if span <= 0.0:
            return Timing(step_ms=step_ms)
        ratio = sum(dt for _, _, dt in self._steps) / span
        # The frame that waits for its time belongs to the span, but is not counted yet.
        dt = self._steps[-1][2]
        late = span > 0.5 and ratio + dt / span < (1.0 - TOLERANCE) * speed
        return Timing(step_ms, len(self._steps) / span, ratio, not late)
