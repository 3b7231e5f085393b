"""The value of the field under the pointer of each visitor."""

from __future__ import annotations

import html
import threading
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.app.viewer.controls.view.overlay import Overlay
from supple.app.viewer.drawing.stage import Stage
from supple.app.viewer.protocol.quantities import written


class Probe:
    """Draws a label at the pointer of a visitor, where it is over a body with colors.

    Attributes
    ----------
    pointer : a text input, which `server/page/page.js` sets to the place of the pointer
    """

    def __init__(self, server: Any, stage: Stage) -> None:
        self._server, self._stage = server, stage
        self._lock = threading.Lock()
        self._places: dict[int, tuple[float, float]] = {}  # by visitor
        self._labels: dict[int, Overlay] = {}
        self.pointer = server.gui.add_text("beside nothing", "", visible=False)
        self.pointer.on_update(self._moved)
        server.on_client_disconnect(self._forget)

    def refresh(self) -> None:
        """Update all labels."""
        for visitor, client in self._server.get_clients().items():
            if visitor in self._places:
                self._label(visitor, client)

    def _moved(self, event: Any) -> None:
        if event.client is None:
            return
        try:
            x, y = (float(word) for word in str(self.pointer.value).split())
            place = x, y
        except ValueError:
            place = None
        with self._lock:
            if place is None or not np.isfinite(place).all():
                self._places.pop(event.client_id, None)
            else:
                self._places[event.client_id] = place
        self._label(event.client_id, event.client)

    def _label(self, visitor: int, client: Any) -> None:
        with self._lock:
            place, text = self._places.get(visitor), ""
            field = self._stage.field
            if place is not None and field is not None:
                found = self._stage.value_on_ray(np.asarray(client.camera.position), ray(client.camera, *place))
                if found is not None:
                    text = html.escape(f"{written(found[1], field.unit)} · {found[0]}")
            if text and visitor not in self._labels:
                self._labels[visitor] = Overlay(client.gui)
            if visitor in self._labels:
                self._labels[visitor].show("value", text)

    def _forget(self, client: Any) -> None:
        with self._lock:
            self._places.pop(client.client_id, None)
            self._labels.pop(client.client_id, None)


def ray(camera: Any, x: float, y: float) -> NDArray[np.float64]:
    """The direction (3,) in which a camera sees the place (x, y) of its picture, from -1 to 1, y upwards."""
    from scipy.spatial.transform import Rotation

    w, i, j, k = camera.wxyz
    half = float(np.tan(0.5 * camera.fov))
    return Rotation.from_quat([i, j, k, w]).apply([x * half * camera.aspect, -y * half, 1.0])
