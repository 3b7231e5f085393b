"""Mouse input: grabs, pins, and the pusher; and the folder "Mouse" of the panel."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.app.viewer.controls.controller import Controller, sequential
from supple.app.viewer.controls.unit_slider import Scale, UnitSlider
from supple.app.viewer.protocol import limits
from supple.app.viewer.protocol.commands import (
    Command,
    Grab,
    MoveGrab,
    MovePusher,
    Pin,
    ReleaseGrab,
    RemovePusher,
    Unpin,
)
from supple.results.view.camera import fit
from supple.results.view.picking import nearest_surface_point, point_on_camera_plane, surface_point_on_ray
from supple.results.view.stage import Stage

DRAG, PUSH = "drag and pin", "push"
MODES = (DRAG, PUSH)


class MouseControls:
    """The folder "Mouse".

    Parameters
    ----------
    changed : called when another mode is selected
    """

    def __init__(self, gui: Any, controller: Controller, changed: Callable[[], None]) -> None:
        self._changed = changed
        self._controller = controller
        scene = controller.snapshot.description
        size = max(float(max(scene.high - scene.low)), 10.0 * limits.SMALLEST_LENGTH)
        self._radii = 0.02 * size, 0.5 * size
        with gui.add_folder("Mouse"):
            self.mode = gui.add_dropdown("Left button", MODES, initial_value=DRAG, hint="What the left button does")
            self._hint = gui.add_markdown(_HINTS[DRAG])
            self.strength = UnitSlider(
                gui,
                "Strength",
                Scale(0.03, 30.0, limits.WEAKEST_GRAB, limits.STRONGEST_GRAB, logarithmic=True),
                1.0,
                hint="Stiffness of the spring, as a factor of one with which the body oscillates at 4 Hz",
            )
            self.radius_input = UnitSlider(
                gui,
                "Ball",
                Scale(*self._radii, *self._radii, "m"),
                0.15 * size,
                hint="Radius of the ball that pushes",
                visible=False,
            )
            self.unpin = gui.add_button("Unpin all", hint="Release all vertices that were pinned on the page")
        # In order, so that the backdrop exists exactly in the mode "push".
        self.mode.on_update(sequential(self._switch))
        self.unpin.on_click(sequential(lambda e: controller.send(e.client, Unpin)))

    @property
    def pushes(self) -> bool:
        """Whether the mouse moves the ball."""
        return self.mode.value == PUSH

    @property
    def stiffness(self) -> float:
        """Stiffness factor of grabs."""
        return self.strength.value

    @property
    def radius(self) -> float:
        """Radius of the ball [m]."""
        return self.radius_input.value

    def _switch(self, event: Any) -> None:
        pushes = self.pushes
        self._hint.content = _HINTS[PUSH if pushes else DRAG]
        self.strength.visible, self.radius_input.visible = not pushes, pushes
        if not pushes:
            self._controller.send(event.client, RemovePusher)
        self._changed()


_HINTS = {
    DRAG: "Drag a body to pull it; release it to throw it. Click to pin or unpin. Drag beside it to turn the camera.",
    PUSH: "Hold the button anywhere: a ball follows the pointer. The right button and the wheel move the camera.",
}


_BACKDROP = "/backdrop"


_DOUBLE_CLICK = 0.4  # longest time between two clicks [s]


@dataclass(frozen=True, eq=False)
class _Click:
    """A click on a body: who clicked, when [s], and the command that takes its effect back."""

    visitor: int
    at: float
    undo: Callable[[], Command]


@dataclass(frozen=True, eq=False)
class _Push:
    """An active push: a point of the plane in which the ball moves, and the offset of the ball from the pointer."""

    through: NDArray[np.float64]
    offset: NDArray[np.float64]


class Mouse:
    """Converts mouse events of visitors into commands. The events of one visitor arrive in order, in the server loop.

    Parameters
    ----------
    server : of viser; controller : sends the commands; controls : mode of the mouse
    """

    def __init__(self, server: Any, controller: Controller, controls: MouseControls) -> None:
        self._server, self._controller, self._controls = server, controller, controls
        self._stage: Stage | None = None
        self._numbers = itertools.count(1)
        self._grabs: dict[int, int] = {}  # by visitor
        self._pushes: dict[int, _Push] = {}
        self._backdrop: Any = None
        self._click: _Click | None = None
        server.on_client_disconnect(lambda client: self.release(client.client_id))

    def attach(self, stage: Stage) -> None:
        """Use the bodies of this stage; and those that it draws later."""
        self._stage = stage
        stage.prepare_bodies(self.add_handlers)
        self.switch()

    def add_handlers(self, handles: list[Any]) -> None:
        """Add drag and click handlers to the meshes of bodies."""
        for handle in handles:
            # Coroutines, because viser runs them in order, and functions in any order.
            handle.on_drag("left")(self.drag)
            handle.on_click(self.click)

    def switch(self) -> None:
        """Add a backdrop in the mode "push", so that mouse events arrive from the whole picture."""
        if self._stage is None:
            return
        if self._controls.pushes and self._backdrop is None:
            view = self._stage.model.view
            self._backdrop = self._server.scene.add_icosphere(
                _BACKDROP,
                radius=60.0 * view.radius,
                opacity=0.0,
                wireframe=True,  # invisible lines are cheaper than invisible faces
                side="double",
                position=tuple(view.center),
                cast_shadow=False,
                receive_shadow=False,
            )
            self._backdrop.on_drag("left")(self.drag)
        elif not self._controls.pushes and self._backdrop is not None:
            self._backdrop.remove()
            self._backdrop = None

    async def drag(self, event: Any) -> None:
        """Called by viser during a drag."""
        if event.phase == "end":  # in every mode: it may have changed since the start
            self.release(event.client_id)
        elif self._controls.pushes:
            self._push(event)
        else:
            self._pull(event)

    async def click(self, event: Any) -> None:
        """Called by viser when a body is clicked: pin the vertex there, or unpin it."""
        if self._stage is None or self._controls.pushes or not _finite(event.ray_origin, event.ray_direction):
            return
        point = surface_point_on_ray(self._stage.moment, event.ray_origin, event.ray_direction)
        if point is None:
            return
        body, vertex = point.body, point.nearest_vertex
        before, self._click = self._click, None
        if before is not None and before.visitor == event.client_id and time.monotonic() - before.at < _DOUBLE_CLICK:
            # The second click of two: the first one has no effect, and the body fills the picture.
            self._controller.send(event.client, before.undo)
            fit(event.client, self._stage.moment.finite_positions[body.vertices])
            return
        held = vertex + body.vertices.start in self._controller.snapshot.pinned
        act, undo = (Unpin, Pin) if held else (Pin, Unpin)
        self._click = _Click(event.client_id, time.monotonic(), lambda: undo(body.name, vertex))
        self._controller.send(event.client, lambda: act(body.name, vertex))

    def release(self, visitor: int) -> None:
        """End the grab or push of a visitor."""
        self._pushes.pop(visitor, None)
        number = self._grabs.pop(visitor, None)
        if number is not None:
            self._controller.send(None, lambda: ReleaseGrab(number))

    def _pull(self, event: Any) -> None:
        visitor = event.client_id
        if not _finite(event.start_position, event.end_position) or self._stage is None:
            return
        if event.phase == "start":
            self.release(visitor)
            point = nearest_surface_point(self._stage.moment, event.start_position)
            number = self._grabs[visitor] = next(self._numbers)
            self._controller.send(
                event.client,
                lambda: Grab(
                    number,
                    point.body.name,
                    tuple(int(v) for v in point.vertices),
                    tuple(float(w) for w in point.weights),
                    event.end_position,
                    self._controls.stiffness,
                ),
            )
        elif visitor in self._grabs:
            self._controller.send(event.client, lambda: MoveGrab(self._grabs[visitor], event.end_position))

    def _push(self, event: Any) -> None:
        visitor = event.client_id
        if not _finite(event.start_position, event.end_position) or self._stage is None:
            return
        camera = event.client.camera
        eye, look = np.asarray(camera.position), np.asarray(camera.look_at) - np.asarray(camera.position)
        if event.phase == "start":
            self._pushes[visitor] = self._begin_push(event, eye)
        push = self._pushes.get(visitor)
        if push is None:
            return
        place = point_on_camera_plane(eye, event.end_position, look, push.through)
        if place is not None:
            x, y, z = (float(coordinate) for coordinate in place + push.offset)
            self._controller.send(event.client, lambda: MovePusher((x, y, z), self._controls.radius))

    def _begin_push(self, event: Any, eye: NDArray[np.float64]) -> _Push:
        """On a body, the ball starts in front of the clicked point; otherwise in the plane of the bodies."""
        assert self._stage is not None
        if event.target.name == _BACKDROP:
            return _Push(self._stage.moment.finite_positions.mean(axis=0), np.zeros(3))
        touched = np.asarray(event.start_position)
        toward = eye - touched
        toward /= max(float(np.linalg.norm(toward)), 1e-12)
        return _Push(touched, 1.05 * self._controls.radius * toward)


def _finite(*points: Any) -> bool:
    return all(np.shape(point) == (3,) and np.isfinite(np.asarray(point, dtype=np.float64)).all() for point in points)
