"""Mouse input: grabs and pins; and the folder "Mouse" of the panel."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from supple.app.viewer.controls.controller import Controller, sequential
from supple.app.viewer.controls.number_input import NumberInput
from supple.app.viewer.protocol import limits
from supple.app.viewer.protocol.commands import (
    Command,
    Grab,
    MoveGrab,
    Pin,
    ReleaseGrab,
    Unpin,
)
from supple.results.view.camera import fit
from supple.results.view.picking import nearest_surface_point, surface_point_on_ray
from supple.results.view.stage import Stage


class MouseControls:
    """The folder "Mouse"."""

    def __init__(self, gui: Any, controller: Controller) -> None:
        with gui.add_folder("Mouse"):
            gui.add_markdown(
                "Drag a body to pull it; release it to throw it. Click to pin or unpin. Drag beside it to turn the "
                "camera."
            )
            self.strength = NumberInput(
                gui,
                "Strength",
                1.0,
                limits.WEAKEST_GRAB,
                limits.STRONGEST_GRAB,
                hint="Stiffness of the spring, as a factor of one with which the body oscillates at 4 Hz",
            )
            self.unpin = gui.add_button("Unpin all", hint="Release all vertices that were pinned on the page")
        self.unpin.on_click(sequential(lambda e: controller.send(e.client, Unpin)))


_DOUBLE_CLICK = 0.4  # longest time between two clicks [s]


@dataclass(frozen=True, eq=False)
class _Click:
    """A click on a body: who clicked, when [s], and the command that takes its effect back."""

    visitor: int
    at: float
    undo: Callable[[], Command]


class Mouse:
    """Converts mouse events of visitors into commands. The events of one visitor arrive in order, in the server loop.

    Parameters
    ----------
    server : of viser; controller : sends the commands; controls : the strength of springs
    """

    def __init__(self, server: Any, controller: Controller, controls: MouseControls) -> None:
        self._server, self._controller, self._controls = server, controller, controls
        self._stage: Stage | None = None
        self._numbers = itertools.count(1)
        self._grabs: dict[int, int] = {}  # by visitor
        self._click: _Click | None = None
        server.on_client_disconnect(lambda client: self.release(client.client_id))

    def attach(self, stage: Stage) -> None:
        """Use the bodies of this stage; and those that it draws later."""
        self._stage = stage
        stage.prepare_bodies(self.add_handlers)

    def add_handlers(self, handles: list[Any]) -> None:
        """Add drag and click handlers to the meshes of bodies."""
        for handle in handles:
            # Coroutines, because viser runs them in order, and functions in any order.
            handle.on_drag("left")(self.drag)
            handle.on_click(self.click)

    async def drag(self, event: Any) -> None:
        """Called by viser during a drag."""
        if event.phase == "end":
            self.release(event.client_id)
        else:
            self._pull(event)

    async def click(self, event: Any) -> None:
        """Called by viser when a body is clicked: pin the vertex there, or unpin it."""
        if self._stage is None or not _finite(event.ray_origin, event.ray_direction):
            return
        point = surface_point_on_ray(self._stage.frame, event.ray_origin, event.ray_direction)
        if point is None:
            return
        body, vertex = point.body, point.nearest_vertex
        before, self._click = self._click, None
        if before is not None and before.visitor == event.client_id and time.monotonic() - before.at < _DOUBLE_CLICK:
            # The second click of two: the first one has no effect, and the body fills the picture.
            self._controller.send(event.client, before.undo)
            fit(event.client, self._stage.frame.finite_positions[body.vertices])
            return
        held = vertex + body.vertices.start in self._controller.snapshot.pinned
        act, undo = (Unpin, Pin) if held else (Pin, Unpin)
        self._click = _Click(event.client_id, time.monotonic(), lambda: undo(body.name, vertex))
        self._controller.send(event.client, lambda: act(body.name, vertex))

    def release(self, visitor: int) -> None:
        """End the grab of a visitor."""
        number = self._grabs.pop(visitor, None)
        if number is not None:
            self._controller.send(None, lambda: ReleaseGrab(number))

    def _pull(self, event: Any) -> None:
        visitor = event.client_id
        if not _finite(event.start_position, event.end_position) or self._stage is None:
            return
        if event.phase == "start":
            self.release(visitor)
            point = nearest_surface_point(self._stage.frame, event.start_position)
            number = self._grabs[visitor] = next(self._numbers)
            self._controller.send(
                event.client,
                lambda: Grab(
                    number,
                    point.body.name,
                    tuple(int(v) for v in point.vertices),
                    tuple(float(w) for w in point.weights),
                    event.end_position,
                    self._controls.strength.value,
                ),
            )
        elif visitor in self._grabs:
            self._controller.send(event.client, lambda: MoveGrab(self._grabs[visitor], event.end_position))


def _finite(*points: Any) -> bool:
    return all(np.shape(point) == (3,) and np.isfinite(np.asarray(point, dtype=np.float64)).all() for point in points)
