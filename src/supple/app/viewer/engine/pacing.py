"""Simulated time and wall-clock time: when the next frame is due, and whether frames are on time."""

from __future__ import annotations

from collections import deque

from supple.app.viewer.protocol.snapshots import Timing

# Length of the time window of measurements [s].
WINDOW = 1.0
# Share by which the simulation may be slower than the requested speed.
TOLERANCE = 0.1


class Pacing:
    """The clock of a running simulation. All times are values of `time.perf_counter` [s]."""

    def __init__(self) -> None:
        self.due = 0.0
        self._begun = 0.0
        self._steps: deque[tuple[float, float, float]] = deque()

    def start(self, now: float) -> None:
        """Start the time, or change its speed."""
        self.due = self._begun = now
        self._steps.clear()

    def stepped(self, now: float, seconds: float, dt: float, speed: float) -> None:
        """A step of `dt` [s] has been simulated, in `seconds` of wall-clock time."""
        self._steps.append((now, seconds, dt))
        while self._steps[0][0] < now - WINDOW and len(self._steps) > 2:
            self._steps.popleft()
        # A late step is compensated by at most one step, so that the motion does not run faster after a delay.
        self.due = max(self.due + dt / speed, now - dt / speed)

    def timing(self, now: float, speed: float, playing: bool) -> Timing:
        """The speed within the last window."""
        if not self._steps:
            return Timing()
        step_ms = 1e3 * sum(seconds for _, seconds, _ in self._steps) / len(self._steps)
        if not playing:
            return Timing(step_ms=step_ms)
        span = now - max(self._begun, self._steps[0][0] - self._steps[0][1])
        if span <= 0.0:
            return Timing(step_ms=step_ms)
        ratio = sum(dt for _, _, dt in self._steps) / span
        # The frame that is not due yet belongs to the span, but is not counted yet.
        dt = self._steps[-1][2]
        late = span > 0.5 and ratio + dt / span < (1.0 - TOLERANCE) * speed
        return Timing(step_ms, len(self._steps) / span, ratio, not late)
