"""Columns of a recording's table against each other, such as a force against a displacement."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from supple.errors import OutputError
from supple.kinds.suggestion import suggestion
from supple.results.export.table import report_columns
from supple.results.recording.reader import Recording
from supple.runtime.figures import legend_below, paper_figure

# The unit of a column by the last of the words of its name, without x, y and z, that is here.
_UNITS = {
    "time": "s", "displacement": "m", "force": "N", "forces": "N", "work": "J", "angle": "rad", "distance": "m",
    "min_distance": "m", "center": "m", "normal": "N", "cavity_pressure": "Pa", "cavity_volume": "m³",
    "cable_tension": "N", "cable_length": "m", "kinetic_energy": "J", "elastic_energy": "J", "potential_energy": "J",
    "stitch_energy": "J", "energy_residual": "J", "cavity_work": "J", "cable_work": "J", "reaction_forces": "N",
    "contact_forces": "N", "friction_forces": "N", "joint_forces": "N", "joint_torques": "N m",
    "time_error": "m", "unbalanced_force": "N",
    "linear_momentum": "kg m/s", "angular_momentum": "kg m²/s", "wall_seconds": "s", "von_mises": "Pa",
}  # fmt: skip


def write_curves(recording: Recording, x: str, y: Sequence[str], output: Path) -> Path:
    """Draw columns of the table over another one to a PNG, PDF or SVG file; see `report_columns`.

    Raises
    ------
    OutputError : where no such column with numbers exists, or the picture cannot be written.
    """
    columns = {name: values for name, values in report_columns(recording).items() if values.dtype.kind in "if"}
    x, *y = (_name(name, list(columns), recording) for name in (x, *y))
    with paper_figure(output, 6.0, 4.2) as figure:
        axis = figure.add_subplot()
        for name in y:
            axis.plot(columns[x], columns[name], marker="." if len(recording) <= 60 else None, label=name)
        units = list(dict.fromkeys(_unit(name) for name in y))
        axis.set_xlabel(_label(x))
        axis.set_ylabel(_label(y[0]) if len(y) == 1 else f"[{'], ['.join(unit or '-' for unit in units)}]")
        if len(y) > 1:
            legend_below(axis)
    return output


def _name(given: str, known: Sequence[str], recording: Recording) -> str:
    """The column of that name; `sensors.` may be left out."""
    for name in (given, f"sensors.{given}"):
        if name in known:
            return name
    raise OutputError(f"{recording.path}: its table has no column {given!r} of numbers; {suggestion(given, known)}")


def _unit(name: str) -> str:
    return next((_UNITS[word] for word in reversed(name.split(".")) if word in _UNITS), "")


def _label(name: str) -> str:
    unit = _unit(name)
    return f"{name} [{unit}]" if unit else name
