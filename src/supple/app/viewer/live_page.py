"""The page of a live simulation."""

from __future__ import annotations

import logging
import threading
import time
from typing import Any

from supple.app.viewer.controls.controller import Controller, Simulation
from supple.app.viewer.frame_rate import FrameRate
from supple.app.viewer.from_snapshot import RenderFrameBuilder
from supple.app.viewer.panel import Panel
from supple.app.viewer.protocol.commands import Watch
from supple.app.viewer.protocol.snapshots import Progress, Snapshot
from supple.results.view.options import ViewOptions
from supple.results.view.stage import Stage

logger = logging.getLogger(__name__)

# A message arrives every half a second. After this time the page displays "Busy" [s].
_SILENT_AFTER = 2.0
# Nobody watches where there was no browser for this time: one that loads the page again comes back sooner [s].
_UNWATCHED_AFTER = 2.0
_IDLE = 0.1  # between two checks for visitors, while nothing changes [s]


class LivePage:
    """Draws the newest snapshot, at a rate that the browsers can follow, and sends commands to the simulation.

    Page and simulation never wait for each other.

    Parameters
    ----------
    server : of viser; simulation : see `Simulation`; first : its first snapshot
    """

    def __init__(self, server: Any, simulation: Simulation, first: Snapshot) -> None:
        self._simulation = simulation
        self._frame_builder = RenderFrameBuilder()
        self._displayed, self._starts = first, simulation.starts
        self._server, self._watched, self._seen_at = server, True, time.monotonic()
        self.controller = Controller(simulation, first)
        self.panel = Panel(server, self.controller)
        frame = self._frame_builder.frame(first)
        self.stage = Stage(server, frame, ViewOptions())
        self.panel.attach(self.stage)
        self._frame_rate = FrameRate(server)
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, name="supple page", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread that draws."""
        self._end.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._end.wait(self._frame_rate.pause()):
            if not self._frame_rate.may_send():
                continue
            self._simulation.wait_for_news(_IDLE)
            try:
                self._notice_visitors()
                self._draw_newest()
                self.panel.refresh()
            except Exception:
                # An error in one snapshot must not stop the page.
                logger.exception("page: a snapshot could not be drawn")

    def _notice_visitors(self) -> None:
        """Tell the simulation whether anybody watches."""
        now = time.monotonic()
        if self._server.get_clients():
            self._seen_at = now
        watched = now - self._seen_at < _UNWATCHED_AFTER
        if watched != self._watched:
            self._watched = watched
            self._simulation.send(Watch(watched))

    def _draw_newest(self) -> None:
        """Draw the newest snapshot, if it has not been drawn yet."""
        error = self._simulation.error
        if error is not None:
            self.panel.time.show_error(error)
        elif self._simulation.starts != self._starts:
            self._starts = self._simulation.starts
            self._frame_builder = RenderFrameBuilder()
            self.panel.restarted()
        snapshot = self._simulation.latest()
        if snapshot is None or snapshot is self._displayed:
            if error is None:
                self._show_progress()
            return
        self.panel.time.go_on()
        with self._frame_rate.sending():
            self._displayed = snapshot
            self.stage.show(self._frame_builder.frame(snapshot))
            self.panel.views.cameras.move()
            self.panel.record.note(self.stage.frame)
            self.panel.show(snapshot)

    def _show_progress(self) -> None:
        silent = max(0.0, time.monotonic() - self._simulation.heard_at)
        progress = self._simulation.progress or (Progress(silent) if silent > _SILENT_AFTER else None)
        if progress is not None:
            self.panel.time.wait(progress)
        else:
            self.panel.time.go_on()
