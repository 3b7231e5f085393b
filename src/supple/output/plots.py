"""One picture of all measurements of a recording over time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import OutputError
from supple.files.replacing import whole_file
from supple.output.drawing import body_color, opened
from supple.output.recording.reader import Recording

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
_AXES = (("x", "#d1495b"), ("y", "#3a7d44"), ("z", "#30638e"))


def plot_recording(recording: Recording | str | Path, output: str | Path) -> Path:
    """Draw energies, momenta, volumes, the smallest J and the time of each step to a PNG (or PDF, SVG) file.

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
        figure = Figure(figsize=(12.0, 9.0), layout="constrained", dpi=110)
        FigureCanvasAgg(figure)
        axes = figure.subplots(3, 2, sharex=True)
        _draw(source, axes)
        for axis in axes.flat:
            axis.grid(alpha=0.25, linewidth=0.6)
            axis.spines[["top", "right"]].set_visible(False)
        for axis in axes[-1]:
            axis.set_xlabel("time [s]")
        names = ", ".join(body.name for body in source.bodies[:6]) + (", …" if len(source.bodies) > 6 else "")
        figure.suptitle(f"{source.path.name}: {names} ({len(source)} frames)")
        with whole_file(output) as fresh:
            figure.savefig(fresh, format=kind)
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
