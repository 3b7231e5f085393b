"""The reports of all frames as a table."""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.results.recording.reader import Recording
from supple.results.recording.recorder import REPORT_NUMBERS, REPORT_VECTORS
from supple.runtime.replacing import whole_file

_AXES = "xyz"


def report_columns(recording: Recording) -> dict[str, NDArray[Any]]:
    """By name, one value for each frame: what `Report` has, then the solver's details, in SI units.

    A vector is three columns, `linear_momentum.x` and so on; a mapping of the details one, or three, for each of its
    names, such as `contact_forces.ball.x`. Of a recorded field that is a number, each body has its largest value, such
    as `von_mises.ball.max`. What sensors, obstacles and pins have is in `supple.results.readings.reading`, such as
    `sensors.tip.normal` and `plate.force`. NaN stands for None.
    """
    columns: dict[str, NDArray[Any]] = {
        "frame": recording.frame_values("index"),
        "time": recording.times,
        "status": np.array([str(status) for status in recording.statuses]),
        "iterations": recording.frame_values("iterations"),
        **{name: recording.series(name) for name in REPORT_NUMBERS},
    }
    for name in REPORT_VECTORS:
        _add_vectors(columns, name, recording.series(name))
    for field in recording.details.fields:
        values = recording.frame_values(f"details/{field.name}")
        for k, key in enumerate(field.keys or ()):
            if field.row_shape:
                _add_vectors(columns, f"{field.name}.{key}", values[:, k])
            else:
                columns[f"{field.name}.{key}"] = values[:, k]
        if field.keys is None:
            columns[field.name] = values
    _add_fields(columns, recording)
    for sensor in recording.sensors:
        columns |= sensor.columns(recording.frame_values(sensor.series_name))
    columns["message"] = np.array(recording.messages)
    return columns


def _add_vectors(columns: dict[str, NDArray[Any]], name: str, values: NDArray[Any]) -> None:
    for axis, column in zip(_AXES, values.T, strict=True):
        columns[f"{name}.{axis}"] = column


def _add_fields(columns: dict[str, NDArray[Any]], recording: Recording) -> None:
    for field in recording.fields:
        if field.shape == ():
            frames = [frame.field(field.name) for frame in recording]
            for name in frames[0] if frames else ():
                columns[f"{field.name}.{name}.max"] = np.array([values[name].max() for values in frames])


def write_csv(recording: Recording, output: Path) -> None:
    """Write one row for each frame, with all digits; a cell without a value is empty."""
    columns = report_columns(recording)
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*(map(_cell, column.tolist()) for column in columns.values()), strict=True))
    with whole_file(output) as fresh:
        fresh.write_text(text.getvalue(), encoding="utf-8", newline="")


def _cell(value: Any) -> Any:
    return "" if isinstance(value, float) and math.isnan(value) else value
