"""The camera of one visitor that is carried along with bodies."""

from __future__ import annotations

import threading
from collections import deque
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.results.view.camera import follow

_SAME = 1e-4  # places closer than this share of the radius of the scene are the same
_PLACES = 64  # that are known: about two seconds of pictures


class CarriedCamera:
    """Moves a camera although its browser reports it late.

    A report that the browser has sent before it received the last move says where the camera was. A move from there
    would lose the way in between, for good. The places to which the camera was moved are known, so a report from an
    earlier one is understood as the last.

    Parameters
    ----------
    client : of viser; radius : of the scene [m]
    """

    def __init__(self, client: Any, radius: float) -> None:
        self._client, self._same = client, _SAME * radius
        self._lock = threading.Lock()  # reports come in threads of the server
        self._places: deque[NDArray[np.float64]] = deque(maxlen=_PLACES)  # looked at [m], the last one is wished

    def forget(self) -> None:
        """Called where the camera is put elsewhere."""
        with self._lock:
            self._places.clear()

    def carry(self, displacement: NDArray[np.float64]) -> None:
        """Move the camera, and the point that it looks at, by `displacement` (3,) [m] from the wished place."""
        with self._lock:
            looked_at, late = np.asarray(self._client.camera.look_at), self._late()
            if late is None:  # the visitor moves it
                self._places.clear()
                self._places.append(looked_at)
                late = np.zeros(3)
            self._places.append(looked_at + late + displacement)
            follow(self._client, late + displacement)

    def keep(self) -> None:
        """Called with every report of the browser: an earlier place is corrected."""
        with self._lock:
            late = self._late()
            if late is not None and late.any():
                follow(self._client, late)

    def _late(self) -> NDArray[np.float64] | None:
        """(3,) the way from where the camera is to the wished place [m]; None where it has left the known places."""
        looked_at = np.asarray(self._client.camera.look_at)
        for k, place in enumerate(reversed(self._places)):
            if np.linalg.norm(place - looked_at) <= self._same:
                return np.zeros(3) if k == 0 else self._places[-1] - looked_at
        return None
