"""The panel of a live simulation: its measures, and all that a visitor can change."""

from __future__ import annotations

import time
from typing import Any

from supple.app.viewer.controls.body_controls import BodyControls
from supple.app.viewer.controls.controller import Controller, notify
from supple.app.viewer.controls.measures import Measures, Sensors
from supple.app.viewer.controls.mouse import Mouse, MouseControls
from supple.app.viewer.controls.solver_controls import SolverControls
from supple.app.viewer.controls.time_controls import TimeControls
from supple.app.viewer.controls.view.overlay import Overlay
from supple.app.viewer.controls.view.record_controls import RecordControls
from supple.app.viewer.controls.view.view_controls import ViewControls, add_keys
from supple.app.viewer.protocol.commands import Reset, SetView, Step
from supple.app.viewer.protocol.snapshots import Snapshot
from supple.results.view.fields import FIELDS
from supple.results.view.options import ViewOptions
from supple.results.view.stage import Stage

_NUMBERS_EVERY = 0.15  # [s]; numbers that change faster cannot be read
_PLOTS_EVERY = 0.5  # [s]
TABS = ("Bodies", "View", "Solver")


class Panel:
    """All folders: time at the top, the others in tabs below it.

    Parameters
    ----------
    server : of viser; controller : sends the commands
    """

    def __init__(self, server: Any, controller: Controller) -> None:
        self._server, self._controller = server, controller
        gui, snapshot = server.gui, controller.snapshot
        self.overlay = Overlay(gui)
        self.time = TimeControls(gui, controller, self.overlay)
        tabs = gui.add_tab_group()
        self._bodies_tab, self._view_tab, self._solver_tab = (tabs.add_tab(name) for name in TABS)
        with self._bodies_tab:
            self.mouse_controls = MouseControls(gui, controller)
        self.mouse = Mouse(server, controller, self.mouse_controls)
        self.stage: Stage | None = None
        self._numbers_at = self._plots_at = 0.0
        self._numbers_of: Snapshot | None = None
        self._plots_of: Snapshot | None = None
        self._last_notice = max((notice.number for notice in snapshot.notices), default=0)

    def attach(self, stage: Stage) -> None:
        """Add the folders that need a stage."""
        self.stage = stage
        gui = self._server.gui
        with self._bodies_tab:
            self.bodies = BodyControls(gui, self._controller)
        with self._view_tab:
            self.views = ViewControls(self._server, stage, self.overlay, self.request_view)
            self.record = RecordControls(self._server, stage)
        with self._solver_tab:
            self.solver = SolverControls(gui, self._controller)
            self.measures = Measures(gui, self._controller.snapshot, self.overlay)
            self.sensors = Sensors(gui, self._controller.snapshot)
        self.mouse.attach(stage)
        send = self._controller.send
        add_keys(
            gui,
            self.views.cameras,
            {
                "space": ("Play or pause", self.time.toggle),
                "N": ("One frame", lambda client: send(client, Step)),
                "R": ("Back to the start", lambda client: send(client, Reset)),
            },
        )
        self.show(self._controller.snapshot)
        self.refresh()

    def restarted(self) -> None:
        """The simulation was started again: it does not know what to send, and its notices are new."""
        self.time.restarted()
        self._last_notice = 0
        assert self.stage is not None
        self.request_view(self.stage.options)

    def show(self, snapshot: Snapshot) -> None:
        """Store a snapshot; `refresh` displays it."""
        self._controller.snapshot = snapshot
        self.measures.note(snapshot)
        self.sensors.note(snapshot)
        self._notify(snapshot)

    def refresh(self) -> None:
        """Update what has changed; numbers and plots less often than the picture."""
        snapshot, now = self._controller.snapshot, time.monotonic()
        if snapshot is not self._numbers_of and now - self._numbers_at >= _NUMBERS_EVERY:
            self._numbers_at, self._numbers_of = now, snapshot
            self.time.show(snapshot)
            self.bodies.show(snapshot)
            self.solver.show(snapshot)
            self.views.refresh()
        if snapshot is not self._plots_of and now - self._plots_at >= _PLOTS_EVERY:
            self._plots_at, self._plots_of = now, snapshot
            self.measures.show(snapshot)
            self.sensors.show()

    def _notify(self, snapshot: Snapshot) -> None:
        """Display new notices."""
        for notice in snapshot.notices:
            if notice.number > self._last_notice:
                self._last_notice = notice.number
                for client in self._server.get_clients().values():
                    error = notice.level == "error"
                    notify(client, "Simulation", notice.text, "red" if error else "blue")

    def request_view(self, options: ViewOptions) -> None:
        """Request the values to draw from the simulation, which computes no others."""
        field = FIELDS.get(options.color_by)
        key = field.key if field is not None and options.surface != "wireframe" else None
        self._controller.send(None, lambda: SetView(key, options.velocities, options.contacts))
