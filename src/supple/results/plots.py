"""One picture of all measurements of a recording over time."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import OutputError
from supple.results.drawing import body_color, opened
from supple.results.recording.reader import Recording
from supple.runtime.figures import save_figure

_KINDS = ("png", "pdf", "svg")
_LEGEND: dict[str, Any] = {  # above the axes
    "loc": "lower right",  # the left side may have a power of ten
    "bbox_to_anchor": (1.0, 1.0),
    "borderaxespad": 0.0,
    "ncols": 8,
    "frameon": False,
    "fontsize": "small",
}
STITCH_LINE = "#c77700"
_MAPPINGS = {
    "cavity_pressure": "pressure in cavities [Pa]",
    "cavity_volume": "volume of cavities [m³]",
    "cable_tension": "tension of spans [N]",
    "cable_length": "length of cables [m]",
}
_AXES = (("x", "#d1495b"), ("y", "#3a7d44"), ("z", "#30638e"))


def plot_recording(recording: Recording | str | Path, output: str | Path) -> Path:
    """Draw what a recording has measured over time to a PNG (or PDF, SVG) file.

    Energies, works, momenta, volumes, the smallest J, the time of each step; cavities, cables and sensors where there
    are some.

    Parameters
    ----------
    recording : an open recording, or its path; output : the picture, replaced where it exists.

    Raises
    ------
    OutputError : where the recording cannot be read, or the picture cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    output = Path(output)
    kind = output.suffix[1:].lower()
    if kind not in _KINDS and not output.is_dir():
        raise OutputError(f"{output}: there is no picture format {output.suffix!r}; take .png, .pdf or .svg")
    with opened(recording) as source:
        more = _panels(source)
        rows = 3 + (len(more) + 1) // 2
        figure = Figure(figsize=(12.0, 3.0 * rows), layout="constrained", dpi=110)
        FigureCanvasAgg(figure)
        axes = np.array([figure.add_subplot(rows, 2, k + 1) for k in range(6)]).reshape(3, 2)
        for axis in axes.flat[1:]:
            axis.sharex(axes[0, 0])
        _draw(source, axes)
        for k, draw in enumerate(more):
            axis = figure.add_subplot(rows, 2, 7 + k, sharex=None if draw is _strokes else axes[0, 0])
            draw(axis, source)
        for axis in figure.axes:
            axis.grid(alpha=0.25, linewidth=0.6)
            axis.spines[["top", "right"]].set_visible(False)
        for axis in figure.axes[-2:] if more else axes[-1]:
            if not axis.get_xlabel():
                axis.set_xlabel("time [s]")
        names = ", ".join(body.name for body in source.bodies[:6]) + (", …" if len(source.bodies) > 6 else "")
        figure.suptitle(f"{source.path.name}: {names} ({len(source)} frames)")
        save_figure(figure, output, kind)
    return output


def _draw(recording: Recording, axes) -> None:
    t = recording.times
    energy, volume, linear, angular, worst, wall = axes.flat
    names = ("kinetic", "elastic", "potential", "stitch")[: 4 if len(recording.stitches) else 3]
    parts = {name: recording.series(f"{name}_energy") for name in names}
    for name, values in parts.items():
        energy.plot(t, values, label=name)
    energy.plot(t, sum(parts.values()), color="0.2", linewidth=1.0, linestyle="--", label="sum")
    energy.set_ylabel("energy [J]")
    energy.legend(**_LEGEND)
    _momentum(linear, t, recording.series("linear_momentum"), "linear momentum\n[kg m/s]")
    _momentum(angular, t, recording.series("angular_momentum"), "angular momentum\nabout the center [kg m²/s]")
    ratios = volume_ratios(recording)
    for i, body in enumerate(recording.bodies):
        color = np.array(body_color(i)) / 255.0
        volume.plot(t, ratios[:, i], color=tuple(color), label=body.name if i < 8 else None)
    volume.set_ylabel("volume / rest volume")
    volume.legend(**_LEGEND)
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
    if len(t) > 1 and ms[1:].min() > 0.0 and ms[1:].max() > 20.0 * np.median(ms[1:]):
        wall.set_yscale("log")
    else:
        wall.set_ylim(bottom=0.0)
    wall.set_ylabel("time of a step [ms]")
    stopped = [i for i, status in enumerate(recording.statuses) if status != "converged"]
    if stopped:
        wall.plot(t[stopped], ms[stopped], "x", color="#d1495b", label="not converged")
        wall.legend(**_LEGEND)


def _panels(recording: Recording) -> list[Callable[[Any, Recording], None]]:
    """What is drawn beside the measurements that every recording has."""
    mappings = {field.name for field in recording.details.fields if field.keys}
    panels: list[Callable[[Any, Recording], None]] = [_works] if "work" in mappings else []
    for name, label in _MAPPINGS.items():
        if name in mappings:
            panels.append(partial(_mapping, name=name, label=label))
    panels += [_sensors] if recording.sensors else []
    return [*panels, _strokes] if any(not sensor.is_grid for sensor in recording.sensors) else panels


def _works(axis, recording: Recording) -> None:
    names = next(field.keys for field in recording.details.fields if field.name == "work") or ()
    sums = np.cumsum(recording.frame_values("details/work"), axis=0)
    for name, values in zip(names, sums.T, strict=True):
        if values.any():
            axis.plot(recording.times, values, label=name)
    residual = np.cumsum(recording.frame_values("details/energy_residual"))
    axis.plot(recording.times, residual, color="0.2", linewidth=1.0, linestyle="--", label="residual")
    axis.set_ylabel("work since the start [J]")
    axis.legend(**_LEGEND)


def _mapping(axis, recording: Recording, name: str, label: str) -> None:
    keys = next(field.keys for field in recording.details.fields if field.name == name) or ()
    for key, values in zip(keys, recording.frame_values(f"details/{name}").T, strict=True):
        axis.plot(recording.times, values, label=key)
    axis.set_ylabel(label)
    axis.legend(**_LEGEND)


def _sensors(axis, recording: Recording) -> None:
    for sensor in recording.sensors:
        values = recording.frame_values(f"sensors/{sensor.number}")
        normal = values[..., 0].sum(axis=(1, 2)) if sensor.is_grid else values[:, 3]
        axis.plot(recording.times, normal, label=sensor.name)
    axis.set_ylabel("normal force on sensors [N]")
    axis.legend(**_LEGEND)


def _strokes(axis, recording: Recording) -> None:
    """The normal force on each force sensor against the way of its center of pressure since it was first pushed."""
    for sensor in recording.sensors:
        if not sensor.is_grid:
            values = recording.frame_values(f"sensors/{sensor.number}")
            pushed = values[values[:, 3] > 0.0]
            way = np.linalg.norm(pushed[:, 4:] - pushed[:1, 4:], axis=1)
            axis.plot(way, pushed[:, 3], marker=".", label=sensor.name)
    axis.set_xlabel("displacement of the center of pressure [m]")
    axis.set_ylabel("normal force [N]")
    axis.legend(**_LEGEND)


def _momentum(axis, t: NDArray[np.float64], values: NDArray[np.float64], label: str) -> None:
    for k, (name, color) in enumerate(_AXES):
        axis.plot(t, values[:, k], color=color, label=name)
    axis.set_ylabel(label)
    axis.legend(**_LEGEND)


def volume_ratios(recording: Recording) -> NDArray[np.float64]:
    """Volume of each body over its volume at rest, (frames, bodies): the mean of J, weighted by rest volume."""
    ratios = np.empty((len(recording), len(recording.bodies)))
    for k, frame in enumerate(recording):
        J = frame.det_F
        for i, body in enumerate(recording.bodies):
            V = recording.rest_volumes[body.tets]
            ratios[k, i] = (J[body.tets] @ V) / V.sum()
    return ratios
