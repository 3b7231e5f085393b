"""Simulated time and wall-clock time: when the next frame is due, and whether frames are on time."""

from __future__ import annotations

from collections import deque
from dataclasses import replace

from supple.app.viewer.engine.scene.live_scene import LiveScene
from supple.app.viewer.protocol.snapshots import Snapshot, Timing
from supple.contact.mesh.obstacles import ObstaclePoses
from supple.model.state import State
from supple.solvers.xpbd.workspace import XPBDWorkspace

# Time without a picture, and in a step, after which the next substep of XPBD is drawn [s].
LONGEST_UNSEEN = 0.025


def between(before: State, after: State, share: float) -> State:
    """The state at a share of the way between two."""
    return State(
        before.time + share * (after.time - before.time),
        before.positions + share * (after.positions - before.positions),
        before.velocities + share * (after.velocities - before.velocities),
        internal=after.internal,
        broken_stitches=before.broken_stitches,
    )


def within_step(live: LiveScene, last: Snapshot, shown: float) -> Snapshot | None:
    """The last snapshot with the positions after the latest substep of the current step.

    None where that is not later than `shown` [s], as at the start of a step or in its repetition, and for a solver
    that has no state within a step. What is measured, colors included, is that of the last whole step.
    """
    workspace = live.workspace
    if not isinstance(workspace, XPBDWorkspace) or workspace.time <= shown:
        return None
    system, setup, state = live.system, live.setup, workspace.present()
    points = system.split(state.positions)
    return replace(
        last,
        time=state.time,
        positions=state.positions,
        obstacle_poses=ObstaclePoses(system.obstacles).at(state.time),
        grabs=tuple(spring.drawn(points[spring.command.body]) for spring in setup.grabs.values()),
    )


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
