"""The folder "Sensors" of the panel: what sensors, cavities and cables read, as plots over the last seconds."""

from __future__ import annotations

import threading
from collections import deque
from typing import Any

import numpy as np

from supple.app.viewer.controls.measures import GAP, MOST_POINTS, plot, shown
from supple.app.viewer.protocol.snapshots import Snapshot
from supple.results.view.colors import body_color

_TITLES = {"N": "Force [N]", "Pa": "Pressure [Pa]"}


class Sensors:
    """One plot for each unit; nothing where the scene has no sensor, cavity or cable."""

    def __init__(self, gui: Any, snapshot: Snapshot) -> None:
        self._gui = gui
        self._lock = threading.Lock()
        self._folder = gui.add_folder("Sensors", visible=False)
        self._names: tuple[tuple[str, str], ...] = ()
        self._rows: deque[tuple[float, ...]] = deque(maxlen=MOST_POINTS)
        self.plots: dict[str, Any] = {}
        self.note(snapshot)

    def note(self, snapshot: Snapshot) -> None:
        """Store the values for the plots."""
        names = tuple((each.unit, each.name) for each in snapshot.readings)
        row = snapshot.time, *(each.value for each in snapshot.readings)
        with self._lock:
            if names != self._names or (self._rows and snapshot.time < self._rows[-1][0]):
                self._rows.clear()
                self._names = names
            if names and (not self._rows or snapshot.time - self._rows[-1][0] >= GAP):
                self._rows.append(row)

    def show(self) -> None:
        """Update the plots."""
        with self._lock:
            names, rows = self._names, np.array(self._rows, dtype=np.float64)
        self._folder.visible = bool(names)
        units = tuple(dict.fromkeys(unit for unit, _ in names))
        labels = {unit: tuple(name for other, name in names if other == unit) for unit in units}
        for unit in [unit for unit, handle in self.plots.items() if labels.get(unit) != _labels_of(handle)]:
            self.plots.pop(unit).remove()
        for unit in units:
            if unit not in self.plots:
                colors = ("#{:02x}{:02x}{:02x}".format(*body_color(k)) for k in range(len(labels[unit])))
                with self._folder:
                    series = tuple(zip(labels[unit], colors, strict=True))
                    self.plots[unit] = plot(self._gui, _TITLES[unit], series)
            columns = [k for k, (other, _) in enumerate(names, start=1) if other == unit]
            shown(self.plots[unit], rows, columns)


def _labels_of(handle: Any) -> tuple[str, ...]:
    return tuple(each["label"] for each in handle.series[1:])
