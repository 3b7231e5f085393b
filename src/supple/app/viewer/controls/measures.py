"""The folders "Measures" and "Sensors" of the panel: numbers of the simulation, and plots over the last seconds."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.app.viewer.controls.view.overlay import Overlay, plain
from supple.app.viewer.protocol.quantities import written
from supple.app.viewer.protocol.snapshots import Snapshot
from supple.results.readings.frame_readings import JointReading
from supple.results.view.look import body_color

_SECONDS = 10.0  # of simulated time in a plot
_MOST_JOINTS = 12  # in the text
MOST_POINTS = 300
GAP = _SECONDS / MOST_POINTS  # between two points [s]


class Measures:
    """The folder "Measures"."""

    def __init__(self, gui: Any, snapshot: Snapshot, overlay: Overlay) -> None:
        self._overlay = overlay
        self._lock = threading.Lock()
        self._rows: deque[tuple[float, ...]] = deque(maxlen=MOST_POINTS)
        with gui.add_folder("Measures"):
            self._message = gui.add_markdown("")
            self.energy = plot(gui, "Energy [J]", (("kinetic", "#e65c3c"), ("elastic", "#409ce1")))
            self.spin = plot(gui, "Spin [rad/s]", (("fastest body", "#34ac78"),))
        self.note(snapshot)

    def note(self, snapshot: Snapshot) -> None:
        """Store the values for the plots."""
        measures = snapshot.measures
        row = (
            snapshot.time,
            measures.kinetic_energy,
            measures.elastic_energy,
            _fastest_spin(snapshot),
            measures.kinetic_energy + measures.elastic_energy + measures.potential_energy,
            measures.min_det_F,
        )
        with self._lock:
            if self._rows and snapshot.time < self._rows[-1][0]:
                self._rows.clear()
            if not self._rows or snapshot.time - self._rows[-1][0] >= GAP:
                self._rows.append(row)

    def show(self, snapshot: Snapshot) -> None:
        """Update numbers and plots."""
        self._message.content = measures_text(snapshot)
        with self._lock:
            rows = np.nan_to_num(np.array(self._rows, dtype=np.float64), posinf=0.0, neginf=0.0)
        shown(self.energy, rows, (1, 2))
        shown(self.spin, rows, (3,))
        lines = sparkline(rows[:, 4], "energy") + sparkline(rows[:, 5], "smallest") if len(rows) > 1 else ""
        now = f'energy {written(rows[-1, 4], "J", 3)}</span><span class="smallest">smallest J {rows[-1, 5]:.3f}'
        self._overlay.show("state", f'{lines}<div class="row"><span class="energy">{now}</span></div>')


def plot(gui: Any, title: str, series: Iterable[tuple[str, str]]) -> Any:
    """An empty plot over time of lines with names and colors."""
    from viser import uplot

    lines = tuple(uplot.Series(label=name, stroke=color, width=2) for name, color in series)
    return gui.add_uplot(
        tuple(np.zeros(1) for _ in range(len(lines) + 1)),
        (uplot.Series(label="t [s]"), *lines),
        title=title,
        scales={"x": uplot.Scale(time=False, auto=True), "y": uplot.Scale(auto=True)},
        height=130,
    )


def shown(handle: Any, rows: NDArray[np.float64], columns: Sequence[int]) -> None:
    """Draw columns of rows, the first of which is the time."""
    rows = np.nan_to_num(rows, posinf=0.0, neginf=0.0)
    if len(rows) == len(handle.data[0]) and rows[-1, 0] == handle.data[0][-1]:
        return
    handle.data = tuple(np.ascontiguousarray(rows[:, k]) for k in (0, *columns))


def sparkline(values: NDArray[np.float64], kind: str) -> str:
    """A small plot of values (k,), as SVG in the color of a class; a line in the middle where they do not change."""
    low, high = float(values.min()), float(values.max())
    across = np.linspace(1.0, 149.0, len(values))
    up = (values - low) / (high - low) if high > low else np.full(len(values), 0.5)
    points = " ".join(f"{x:.0f},{y:.1f}" for x, y in zip(across, 22.0 - 20.0 * up, strict=True))
    return f'<svg class="{kind}" viewBox="0 0 150 24"><polyline points="{points}"/></svg>'


def measures_text(snapshot: Snapshot) -> str:
    """Counts, energies, the smallest J, and the status of the last step."""
    scene, measures = snapshot.description, snapshot.measures
    total = measures.kinetic_energy + measures.elastic_energy + measures.potential_energy
    lines = [
        f"{scene.n_tets} tets, {scene.n_vertices} vertices, {scene.n_constraints} constraints",
        f"energy {total:.3g} J, spin {_fastest_spin(snapshot):.3g} rad/s",
        f"smallest J {measures.min_det_F:.3f}, contacts {measures.contacts}",
    ]
    readings = list(measures.joints.items())
    lines += [_joint_text(name, joint) for name, joint in readings[:_MOST_JOINTS]]
    if len(readings) > _MOST_JOINTS:
        lines.append(f"and {len(readings) - _MOST_JOINTS} more joints")
    if measures.status == "linearized":  # as was chosen
        lines.append(f"{plain(measures.status)}: {plain(measures.message)}")
    elif measures.status != "converged":
        lines.append(f'<span style="color: #d92b2b">{plain(measures.status)}: {plain(measures.message)}</span>')
    return "  \n".join(lines)


def _joint_text(name: str, joint: JointReading) -> str:
    """Where a joint is, and with what it holds; angles and torques, or displacements and forces."""
    text = f"{plain(name)}:"
    if joint.coordinate is not None:
        text += f" at {joint.coordinate:.3g},"
    if joint.motor_force is not None:
        text += f" motor {joint.motor_force:.3g},"
    return f"{text} force {np.linalg.norm(joint.force):.3g} N"


def _fastest_spin(snapshot: Snapshot) -> float:
    return float(np.linalg.norm(snapshot.measures.spin, axis=1).max(initial=0.0))


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
        names = tuple((entry.unit, entry.name) for entry in snapshot.readings)
        row = snapshot.time, *(entry.value for entry in snapshot.readings)
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
    return tuple(entry["label"] for entry in handle.series[1:])
