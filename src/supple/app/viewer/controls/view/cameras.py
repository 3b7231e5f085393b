"""The cameras of all visitors: presets, and bodies that they follow."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.app.viewer.controls.view.carried_camera import CarriedCamera
from supple.results.view.bounds import View
from supple.results.view.camera import PRESETS, fit, look_from, stay_above
from supple.results.view.floor_shadow import floor_shadow
from supple.results.view.stage import Stage

ALL, NOTHING = "all bodies", "nothing"
# The center of all bodies may move so far from its start, as a share of the radius of the scene, without the cameras.
_FREE = 0.35
_SHARE = 0.15  # of the way to all bodies that cameras go with one picture


class Cameras:
    """Inputs for the cameras.

    Parameters
    ----------
    server : of viser; stage : has the bodies
    """

    def __init__(self, server: Any, stage: Stage) -> None:
        self._server, self._stage = server, stage
        self._lock = threading.RLock()
        self._carried: dict[int, CarriedCamera] = {}  # by the number of the visitor
        self._start = stage.frame.finite_positions.mean(axis=0)
        self._center: NDArray[np.float64] | None = self._start
        self._time = stage.frame.time  # at which the cameras have moved last
        self.presets = server.gui.add_button_group(
            "Camera", PRESETS, hint="Keys 1 to 5; F fits the picture to the bodies"
        )
        self.follow = server.gui.add_dropdown(
            "Follow",
            self._names(),
            initial_value=ALL,
            hint="The camera moves with a body, or with all bodies where they leave the middle of the picture; a "
            "double click on a body fits the picture to it",
        )
        self.presets.on_click(lambda event: event.client is not None and self.look(event.client, self.presets.value))
        self.follow.on_update(lambda _: self._begin())
        server.on_client_connect(self._welcome)
        server.on_client_disconnect(lambda client: self._carried.pop(client.client_id, None))

    def refresh(self) -> None:
        """Offer the bodies that there are."""
        names = self._names()
        if self.follow.options != names:
            if self.follow.value not in names:
                self.follow.value = NOTHING
            self.follow.options = names

    def move(self) -> None:
        """Called with every drawn frame: the cameras of all visitors move with what they follow."""
        frame, center = self._stage.frame, self._followed()
        with self._lock:
            if self._center is None or center is None:
                return
            displacement = center - self._center
            if self.follow.value == ALL:
                if frame.springs:  # a camera that moves would move the mouse's target
                    return
                displacement *= _SHARE if frame.time >= self._time else 1.0  # back at the start, nothing moves
            if float(np.linalg.norm(displacement)) < 1e-3 * self._stage.model.view.radius:
                return
            self._center, self._time = self._center + displacement, frame.time
        self._carry(lambda client: displacement)

    def fit(self, client: Any) -> None:
        """Show one visitor all bodies as they are."""
        self._carried_of(client).forget()
        fit(client, self._stage.frame.finite_positions)

    def look(self, client: Any, preset: str) -> None:
        """Move the camera of one visitor to a preset."""
        self._carried_of(client).forget()
        look_from(client, preset, self._view())

    def _carry(self, way_of: Callable[[Any], NDArray[np.float64]]) -> None:
        for client in self._server.get_clients().values():
            self._carried_of(client).carry(way_of(client))

    def _carried_of(self, client: Any) -> CarriedCamera:
        with self._lock:
            made = CarriedCamera(client, self._stage.model.view.radius)
            return self._carried.setdefault(client.client_id, made)

    def _view(self) -> View:
        """The view of the scene, moved as far as the cameras were moved with all bodies."""
        view = self._stage.model.view
        if self._center is None or self.follow.value != ALL:
            return view
        displacement = self._center - self._start
        if not displacement.any():
            return view
        return replace(
            view, low=view.low + displacement, high=view.high + displacement, outline=view.outline + displacement
        )

    def _names(self) -> tuple[str, ...]:
        return ALL, NOTHING, *(body.name for body in self._stage.model.bodies)

    def _followed(self) -> NDArray[np.float64] | None:
        """(3,) the center of the body that is followed [m], that of all bodies beyond where it is free, or None."""
        x, chosen = self._stage.frame.finite_positions, self.follow.value
        if chosen == ALL:
            displacement = x.mean(axis=0) - self._start
            free = _FREE * self._stage.model.view.radius
            return self._start + max(0.0, 1.0 - free / max(float(np.linalg.norm(displacement)), free)) * displacement
        rows = (body.vertices for body in self._stage.model.bodies if body.name == chosen)
        of_body = next(rows, None) if chosen != NOTHING else None
        return None if of_body is None else x[of_body].mean(axis=0)

    def _begin(self) -> None:
        center = self._followed()
        with self._lock:
            self._center = center
        if center is not None and self.follow.value != ALL:
            self._carry(lambda client: center - np.asarray(client.camera.look_at))

    def _welcome(self, client: Any) -> None:
        """In a narrow picture, the camera is farther away than in the one that all get at first."""
        view = self._view()
        if client.camera.aspect < 1.0 or view is not self._stage.model.view:
            look_from(client, PRESETS[0], view)
        carried = self._carried_of(client)
        client.camera.on_update(lambda _: carried.keep())
        was_above = False

        def keep_above(_: Any) -> None:
            """A camera under the floor would see nothing."""
            nonlocal was_above
            floor = floor_shadow(self._stage.model, 1)
            if floor is not None:
                was_above = stay_above(client, floor.disc[0], self._stage.model.view, was_above=was_above)

        client.camera.on_update(keep_above)
