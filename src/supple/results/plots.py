"""One picture of all measurements of a recording over time."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from supple.errors import OutputError
from supple.results.curves import write_curves
from supple.results.recording.details import RecordedSensor
from supple.results.recording.reader import Recording, opened
from supple.results.view.look import body_color
from supple.runtime.figures import MOST_ENTRIES, legend_below, paper_figure, spans_decades

STITCH_LINE = "#c77700"
_MAPPINGS = {
    "cavity_pressure": "pressure in cavities [Pa]",
    "cavity_volume": "volume of cavities [m³]",
    "cable_tension": "tension of spans [N]",
    "cable_length": "length of cables [m]",
}
_AXES = (("x", "#d1495b"), ("y", "#3a7d44"), ("z", "#30638e"))


@dataclass(frozen=True, eq=False)
class Plot:
    """What a recording has measured over time, which a notebook shows as the output of a cell.

    Attributes
    ----------
    recording : that is plotted; it must be open
    x, y : columns of its table; without them, all measurements over time
    """

    recording: Recording
    x: str = "time"
    y: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return (
            f"Plot of {self.recording.path.name}: the last line of a notebook's cell shows it; save('p.png') writes it"
        )

    def _repr_png_(self) -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            return self.save(Path(folder, "plot.png")).read_bytes()

    def save(self, path: str | Path) -> Path:
        """Write the plot to a PNG, PDF or SVG file.

        Raises
        ------
        OutputError : where it cannot be written.
        """
        if self.y:
            return write_curves(self.recording, self.x, self.y, Path(path))
        return write_plot(self.recording, path)


def plot(recording: Recording, x: str = "time", y: str | Sequence[str] = ()) -> Plot:
    """What a recording has measured, which a notebook shows; see `Recording.plot`."""
    return Plot(recording, x, (y,) if isinstance(y, str) else tuple(y))


@overload
def plot_recording(recording: Recording, output: None = None) -> Plot: ...


@overload
def plot_recording(recording: Recording | str | Path, output: str | Path) -> Path: ...


def plot_recording(recording: Recording | str | Path, output: str | Path | None = None) -> Path | Plot:
    """Draw what a recording has measured over time to a PNG (or PDF, SVG) file; without one, for a notebook.

    Energies, works, momenta, volumes, the smallest J, the time of each step; cavities, cables and sensors where there
    are some.

    Parameters
    ----------
    recording : an open recording, or its path.
    output : the picture, replaced where it exists; None: nothing is written, and the last line of a notebook's cell
        shows the plot of an open recording.

    Raises
    ------
    OutputError : where the recording cannot be read, or the picture cannot be written.
    """
    if output is not None:
        return write_plot(recording, output)
    if not isinstance(recording, Recording):
        raise OutputError(f"plot_recording: {recording}: give the file to write, or open it with read_recording")
    return Plot(recording)


def write_plot(recording: Recording | str | Path, output: str | Path) -> Path:
    """Draw all measurements over time to a file; see `plot_recording`."""
    output = Path(output)
    with opened(recording) as source:
        more = _panels(source)
        rows = 3 + (len(more) + 1) // 2
        with paper_figure(output, 9.0, 2.7 * rows) as figure:
            axes = [figure.add_subplot(rows, 2, k + 1) for k in range(6)]
            _draw(source, axes)
            for k, draw in enumerate(more):
                axis = figure.add_subplot(rows, 2, 7 + k)
                draw(axis, source)
                axes.append(axis)
            for axis in axes:
                if not axis.get_xlabel():
                    axis.set_xlabel("time [s]")
                    axis.set_xlim(*_whole_time(source))
                legend_below(axis)
            figure.suptitle(_title(source), fontsize=12.0)
    return output


def _title(recording: Recording) -> str:
    names = ", ".join(body.name for body in recording.bodies[:MOST_ENTRIES])
    rest = len(recording.bodies) - MOST_ENTRIES
    return f"{names}{f', … and {rest} more' if rest > 0 else ''} ({len(recording)} frames)"


def _whole_time(recording: Recording) -> tuple[float, float]:
    first, last = recording.times[0], recording.times[-1]
    return first, last if last > first else first + 1.0


def _draw(recording: Recording, axes: Sequence[Any]) -> None:
    t = recording.times
    energy, volume, linear, angular, worst, wall = axes
    names = ("kinetic", "elastic", "potential", "stitch")[: 4 if len(recording.stitches) else 3]
    parts = {name: recording.series(f"{name}_energy") for name in names}
    for name, values in parts.items():
        energy.plot(t, values, label=name)
    energy.plot(t, sum(parts.values()), color="0.2", linewidth=1.0, linestyle="--", label="sum")
    energy.set_ylabel("energy [J]")
    _momentum(linear, t, recording.series("linear_momentum"), "linear momentum\n[kg m/s]")
    _momentum(angular, t, recording.series("angular_momentum"), "angular momentum\nabout the center [kg m²/s]")
    ratios = volume_ratios(recording)
    for i, body in enumerate(recording.bodies):
        volume.plot(t, ratios[:, i], color=tuple(np.array(body_color(i)) / 255.0), label=body.name)
    volume.set_ylabel("volume / rest volume")
    worst.plot(t, recording.series("min_det_F"), color="#7a3e9d")
    worst.axhline(0.0, color="0.2", linewidth=0.8)
    worst.set_ylabel("smallest J = det F")
    stretch = recording.series("largest_stitch_stretch")
    if np.isfinite(stretch).any():
        right = worst.twinx()
        right.plot(t, stretch, color=STITCH_LINE)
        right.set_ylabel("largest stretch of a stitch", color=STITCH_LINE)
        right.spines["top"].set_visible(False)
    ms = 1e3 * recording.series("wall_seconds")
    wall.plot(t[1:], ms[1:], color="0.3")
    # The first step often compiles or loads the kernels; on a linear axis, the other steps would then not be visible.
    if spans_decades(ms[1:]):
        wall.set_yscale("log")
    else:
        wall.set_ylim(bottom=0.0)
    wall.set_ylabel("time of a step [ms]")
    stopped = [i for i, status in enumerate(recording.statuses) if status != "converged"]
    if stopped:
        wall.plot(t[stopped], ms[stopped], "x", color="#d1495b", label="not converged")


def _panels(recording: Recording) -> list[Callable[[Any, Recording], None]]:
    """What is drawn beside the measurements that every recording has."""
    mappings = {field.name for field in recording.details.fields if field.keys}
    panels: list[Callable[[Any, Recording], None]] = [_works] if "work" in mappings else []
    for name, label in _MAPPINGS.items():
        if name in mappings:
            panels.append(partial(_mapping, name=name, label=label))
    given = [sensor for sensor in recording.sensors if sensor.kind != "driven"]
    panels += [partial(_sensors, quantity=item) for item in dict.fromkeys(s.reading.quantity for s in given)]
    return [*panels, _strokes] if any(_has_stroke(recording, sensor) for sensor in recording.sensors) else panels


def _has_stroke(recording: Recording, sensor: RecordedSensor) -> bool:
    numbers = recording.frame_values(sensor.series_name)
    return sensor.kind == "driven" and bool(numbers[:, :3].any() and (np.nan_to_num(numbers[:, 4:]) != 0.0).any())


def _works(axis, recording: Recording) -> None:
    residual = np.cumsum(recording.frame_values("details/energy_residual"))
    axis.plot(recording.times, residual, color="0.2", linewidth=1.0, linestyle="--", label="residual")
    names = next(field.keys for field in recording.details.fields if field.name == "work") or ()
    sums = np.cumsum(recording.frame_values("details/work"), axis=0)
    for name, values in zip(names, sums.T, strict=True):
        if values.any():
            axis.plot(recording.times, values, label=name)
    axis.set_ylabel("work since the start [J]")


def _mapping(axis, recording: Recording, name: str, label: str) -> None:
    keys = next(field.keys for field in recording.details.fields if field.name == name) or ()
    for key, values in zip(keys, recording.frame_values(f"details/{name}").T, strict=True):
        axis.plot(recording.times, values, label=key)
    axis.set_ylabel(label)


def _sensors(axis, recording: Recording, quantity: str) -> None:
    for sensor in recording.sensors:
        if sensor.reading.quantity == quantity and sensor.kind != "driven":
            values = recording.frame_values(sensor.series_name)
            axis.plot(recording.times, [sensor.reading.of_numbers(row).value for row in values], label=sensor.name)
    axis.set_ylabel(quantity)


def _strokes(axis, recording: Recording) -> None:
    """The force of each obstacle and pin that moves against its displacement."""
    for sensor in recording.sensors:
        if _has_stroke(recording, sensor):
            columns = sensor.reading.columns(recording.frame_values(sensor.series_name))
            axis.plot(columns["displacement"], columns["force"], marker=".", label=sensor.name)
    axis.set_xlabel("displacement [m]")
    axis.set_ylabel("force on bodies [N]")


def _momentum(axis, t: NDArray[np.float64], values: NDArray[np.float64], label: str) -> None:
    for k, (name, color) in enumerate(_AXES):
        axis.plot(t, values[:, k], color=color, label=name)
    axis.set_ylabel(label)


def volume_ratios(recording: Recording) -> NDArray[np.float64]:
    """Volume of each body over its volume at rest, (frames, bodies): the mean of J, weighted by rest volume; NaN of
    shells."""
    ratios = np.full((len(recording), len(recording.bodies)), np.nan)
    for k, frame in enumerate(recording):
        J = frame.det_F
        for i, body in enumerate(recording.bodies):
            V = recording.rest_volumes[body.tets]
            if len(V):
                ratios[k, i] = (J[body.tets] @ V) / V.sum()
    return ratios
