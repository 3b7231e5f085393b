"""The loop of the simulation process: takes steps in real time, executes commands, sends snapshots."""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from supple.app.viewer.engine.describe import contact_points, describe, measures, readings, strongest_forces
from supple.app.viewer.engine.pacing import LONGEST_UNSEEN, Pacing, between, within_step
from supple.app.viewer.engine.scene.changes import change
from supple.app.viewer.engine.scene.live_scene import LiveScene
from supple.app.viewer.engine.step_watch import StepWatch, warnings_as_notices
from supple.app.viewer.protocol import commands, limits
from supple.app.viewer.protocol.command_queue import CommandQueue
from supple.app.viewer.protocol.outbox import Outbox
from supple.app.viewer.protocol.snapshots import Notice, Snapshot
from supple.contact.mesh.obstacles import ObstaclePoses
from supple.errors import SuppleError
from supple.model.state import State
from supple.results.readings.tet_readings import tet_values

logger = logging.getLogger(__name__)

HEARTBEAT = 0.5  # longest time between two messages [s]
# Shortest time between two snapshots [s]: slightly less than that between two frames, because jitter of the clock would
# skip every second frame otherwise.
SHORTEST = 0.9 / limits.FRAMES_PER_SECOND
NOTICES_KEPT = 8


class SimulationLoop:
    """Runs a live scene until its command queue is closed.

    Attributes
    ----------
    playing : whether the time runs, as long as somebody watches
    steps_left : number of frames to simulate while it does not
    """

    def __init__(self, live: LiveScene, inbox: CommandQueue, outbox: Outbox) -> None:
        self.live, self.inbox, self.outbox = live, inbox, outbox
        self.playing = False
        self.watched = True
        self.steps_left = 0
        self.speed = 1.0
        self.view = commands.SetView()
        self.pacing = Pacing()
        self.watch = StepWatch(
            limits.LONGEST_STEP, lambda: inbox.holds(commands.Pause, commands.Reset), limits.LONGEST_STEP_WHEN_ASKED
        )
        self.applied = 0
        self._shown = 0.0  # time of the newest picture within the current step [s]
        self._pulled = False  # whether a body was pulled since the last step
        self.notices: deque[Notice] = deque(maxlen=NOTICES_KEPT)
        self._before: State = live.state
        self._last: Snapshot | None = None
        self._described = -1
        self._published = 0.0
        self._fresh = True

    def run(self) -> None:
        """Run until the process of the page ends."""
        with warnings_as_notices(self.notify):
            while not self.inbox.closed:
                self.run_once(self._time_to_wait())

    def run_once(self, wait: float) -> None:
        """Execute commands, take a step if one is due, send a snapshot if there is something new."""
        for number, command in self.inbox.take(wait):
            self.execute(command)
            self.applied = max(self.applied, number)
            self._fresh = True
        now = time.perf_counter()
        if self.steps_left > 0 or (self._runs and now >= self._next_step()):
            self.step()
        now = time.perf_counter()
        since = now - self._published
        if (self._fresh and since >= SHORTEST) or self._interpolates(now):
            self.publish(now)
        elif since >= HEARTBEAT:
            # Nothing has changed: a heartbeat costs less than a snapshot.
            self._published = now
            self.outbox.put_progress(None)

    def execute(self, command: commands.Command) -> None:
        """Execute a command; where it fails, send a notice."""
        try:
            match command:
                case commands.Play():
                    if not self.playing:
                        self.playing = True
                        self.pacing.start(time.perf_counter())
                case commands.Pause():
                    self.playing, self.steps_left = False, 0
                case commands.Step():
                    self.playing = False
                    # Each Step counts, also where the previous one has not been simulated yet.
                    self.steps_left = min(self.steps_left + command.count, limits.MOST_STEPS)
                case commands.SetSpeed():
                    self.speed = command.factor
                    self.pacing.start(time.perf_counter())
                case commands.SetView():
                    self.view = command
                case commands.Watch():
                    if command.watched and not self.watched:
                        self.pacing.start(time.perf_counter())
                    self.watched = command.watched
                case _:
                    self._pulled |= isinstance(command, (commands.Grab, commands.MoveGrab))
                    with self.watch.limited():
                        change(command, self.live)
                    if isinstance(command, commands.Reset):  # frames that were requested before belong to the old start
                        self.steps_left = 0
                    self._before = self.live.state
        except (SuppleError, MemoryError) as error:
            self.notify("error", _one_line(error))
        except Exception as error:
            logger.exception("the command %s failed", command)
            self.notify("error", f"{type(command).__name__} failed: {_one_line(error)}")

    def step(self) -> None:
        """Simulate one frame; where this fails, pause at the last good state, and send a notice with the reason."""
        began = time.perf_counter()
        before, self._pulled = self.live.state, False
        self._shown = before.time
        try:
            with self.watch.limited(self._follow):
                report = self.live.step()
            failed = "" if report.status.can_go_on else f"{report.status}: {report.message}"
        except (SuppleError, ArithmeticError, MemoryError) as error:
            failed = _one_line(error)
        except Exception as error:
            logger.exception("a step failed")
            failed = f"{type(error).__name__}: {_one_line(error)}"
        if failed:
            self.live.prepare_workspace()
        now = time.perf_counter()
        self.steps_left = max(0, self.steps_left - 1)
        self._fresh = True
        if failed and self.inbox.holds(commands.Reset):
            return  # which comes next, and may be why the step was given up
        if failed:
            self.playing, self.steps_left = False, 0
            self.notify("error", f"paused at t = {self.live.state.time:.4g} s; {failed}")
            return
        self._before = before
        self.pacing.stepped(now, now - began, self.live.setup.dt, self.speed)

    def _follow(self) -> None:
        """Pull to where the pointer is by now, within a step, and draw a step that takes long."""
        if self.live.follows_within_steps:
            for number, command in self.inbox.take_leading(commands.MoveGrab):
                self.live.move_grab(command)
                self.applied = max(self.applied, number)

        unseen = min(time.perf_counter() - self._published, self.watch.seconds)
        if self._runs and unseen >= LONGEST_UNSEEN and not self._in_slow_motion():
            self._publish_within_step()

    def _publish_within_step(self) -> None:
        """Send a picture of the current step, where it is of the scene that the page knows."""
        last = self._last if self._described == self.live.revision else None
        picture = None if last is None else within_step(self.live, last, self._shown)
        if picture is not None:
            self._published, self._shown = time.perf_counter(), picture.time
            self.outbox.put_snapshot(replace(picture, applied=self.applied, notices=tuple(self.notices)))

    def notify(self, level: str, text: str) -> None:
        """Send a notice to the page."""
        number = self.notices[-1].number + 1 if self.notices else 1
        self.notices.append(Notice(number, level, text))

    def publish(self, now: float) -> None:
        """Send a snapshot, after a new description where the scene has changed.

        Where that fails, the simulation pauses, and the last snapshot is sent again with an error notice.
        """
        self._published, self._fresh = now, False
        try:
            description = describe(self.live) if self._described != self.live.revision else None
            self._last = self.snapshot(now)
        except Exception as error:
            if self._last is None:
                raise
            text = f"paused; the page cannot be updated: {_one_line(error)}"
            if self.playing or not (self.notices and self.notices[-1].text == text):
                logger.exception("a snapshot could not be made")
                self.notify("error", text)
            self.playing, self.steps_left = False, 0
            self._last = replace(self._last, paused=True, notices=tuple(self.notices), applied=self.applied)
            description = None
        if description is not None:
            self.outbox.put_description(description)
            self._described = description.revision
        self.outbox.put_snapshot(self._last)

    def snapshot(self, now: float) -> Snapshot:
        """The current state; in slow motion, a state between the last two. `Engine` adds the description."""
        live = self.live
        state = self._displayed_state(now)
        system, setup = live.system, live.setup
        points = system.split(state.positions)
        grabs = [spring.drawn(points[spring.command.body]) for spring in setup.grabs.values()]
        contacts = self._requested("contacts", lambda: contact_points(live))
        forces = self._requested("contacts", lambda: strongest_forces(live))
        quantity = self.view.tet_values or ""
        values = self._requested(
            "tet_values", lambda: tet_values(system.laws_at(state.time), state.positions, quantity, state.internal)
        )
        return Snapshot(
            description=None,  # pyright: ignore[reportArgumentType]
            frame=live.frame,
            time=state.time,
            positions=state.positions,
            obstacle_poses=ObstaclePoses(system.obstacles).at(state.time),
            pinned=system.pinned_vertices,
            grabs=tuple(grabs),
            paused=not self.playing,
            speed=self.speed,
            measures=measures(live),
            timing=self.pacing.timing(now, self.speed, self.playing),
            notices=tuple(self.notices),
            applied=self.applied,
            tet_values=values,
            tet_quantity=self.view.tet_values,
            contact_points=contacts,
            contact_forces=forces,
            readings=readings(live),
            broken_stitches=state.broken_stitches,
        )

    def _requested(self, name: str, compute: Callable[[], Any]) -> Any | None:
        """A value that the view requests, or None. Where it cannot be computed, it is turned off, with a notice."""
        if not getattr(self.view, name):
            return None
        try:
            with self.watch.limited():  # the first time, kernels are compiled
                return compute()
        except Exception as error:
            logger.exception("%s could not be computed", name)
            self.view = replace(self.view, **{name: getattr(commands.SetView(), name)})
            self.notify("error", f"{name.replace('_', ' ')} are off: {_one_line(error)}; choose them again to retry")
            return None

    @property
    def _runs(self) -> bool:
        """Whether the time runs now."""
        return self.playing and self.watched

    def _interval(self) -> float:
        return self.live.setup.dt / self.speed

    def _next_step(self) -> float:
        """When the next step begins: when it is due; up to one step earlier where a body was pulled.

        In slow motion, the state of an earlier step would not be displayed earlier.
        """
        early = self._pulled and not self._in_slow_motion()
        return self.pacing.due - (self._interval() if early else 0.0)

    def _in_slow_motion(self) -> bool:
        return self._runs and self.steps_left == 0 and self._interval() > 1.5 / limits.FRAMES_PER_SECOND

    def _interpolates(self, now: float) -> bool:
        return self._in_slow_motion() and now - self._published >= SHORTEST

    def _displayed_state(self, now: float) -> State:
        after, before = self.live.state, self._before
        if not self._in_slow_motion() or before is after or len(before.positions) != len(after.positions):
            return after
        share = float(np.clip(1.0 - (self.pacing.due - now) / self._interval(), 0.0, 1.0))
        return between(before, after, share)

    def _time_to_wait(self) -> float:
        if self.steps_left > 0:
            return 0.0
        now = time.perf_counter()
        ends = [self._published + HEARTBEAT]
        if self._runs:
            ends.append(self._next_step())
        if self._fresh or self._in_slow_motion():
            ends.append(self._published + SHORTEST)
        return max(0.0, min(ends) - now)


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split())[:500] or type(error).__name__
