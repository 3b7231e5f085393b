"""What a recording keeps of the solver's details: one series of fixed size for each field that `SolverDetails` keeps.

A number is one value, with NaN for None. A mapping is one row for each of its names, in an order that the header gives.
A sensor is one series too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.model.state import SolverDetails
from supple.results.readings.driven import driven_names
from supple.results.readings.reading import READINGS, Columns, Reading
from supple.results.recording.file import Series
from supple.scene.scene import Scene


def _kinds() -> dict[str, type[SolverDetails]]:
    # Imported here, so that the independent checker, which imports this module, does not import solvers.
    from supple.solvers.implicit.details import ImplicitDetails
    from supple.solvers.xpbd.details import XPBDDetails

    return {kind.__name__: kind for kind in (SolverDetails, XPBDDetails, ImplicitDetails)}


@dataclass(frozen=True)
class RecordedField:
    """How one field is stored.

    Attributes
    ----------
    name : of the field; dtype : "<i8" or "<f8"
    keys : the names of a mapping; None for a single number
    row_shape : (3,) for mappings to vectors, otherwise ()
    """

    name: str
    dtype: Literal["<i8", "<f8"]
    keys: tuple[str, ...] | None = None
    row_shape: tuple[int, ...] = ()

    @property
    def shape(self) -> tuple[int, ...]:
        return self.row_shape if self.keys is None else (len(self.keys), *self.row_shape)

    @property
    def series(self) -> Series:
        return Series(f"supple/frames/details/{self.name}", 1, self.shape, self.dtype)

    def stored(self, value: Any) -> ArrayLike:
        """The value as an array of `shape`; NaN for None and for names that are missing."""
        if self.keys is None:
            return math.nan if value is None else value
        missing = np.full(self.row_shape, math.nan)
        return np.array([value.get(key, missing) for key in self.keys], dtype=self.dtype).reshape(self.shape)

    def loaded(self, values: NDArray[Any]) -> Any:
        """The value that was stored."""
        if self.keys is None:
            return None if np.isnan(values) else values.item()
        rows = zip(self.keys, values, strict=True)
        return {key: row if self.row_shape else float(row) for key, row in rows if not np.isnan(row).any()}


@dataclass(frozen=True)
class RecordedDetails:
    """The name of the class of a recording's details, and how each of its fields is stored."""

    kind: str = "SolverDetails"
    fields: tuple[RecordedField, ...] = ()

    @classmethod
    def like(cls, details: SolverDetails) -> RecordedDetails:
        """For details with the names and shapes of these. Of a class from outside of Supple, the known base is kept."""
        known = _kinds().values()
        kind = next(base for base in type(details).__mro__ if base in known)
        kept = [field.name for field in fields(kind) if field.compare]
        return cls(kind.__name__, tuple(_field_like(name, getattr(details, name)) for name in kept))

    def check(self) -> None:
        """Raise `ValueError` where this is not what this version writes."""
        kind = _kinds().get(self.kind)
        known = set() if kind is None else {field.name for field in fields(kind) if field.compare}
        if not {field.name for field in self.fields} <= known:
            raise ValueError(f"the solver's details are {self.kind} with fields that are not known here")
        if any(field.row_shape not in ((), (3,)) for field in self.fields):
            raise ValueError("a field of the solver's details has rows that are neither numbers nor vectors")

    def of_frame(self, number: int, series: Callable[[str], NDArray[Any]]) -> SolverDetails:
        """The details of one frame; `series` returns all frames' rows of the series at a path."""
        return _kinds()[self.kind](
            **{field.name: field.loaded(series(field.series.path)[number]) for field in self.fields}
        )


def _field_like(name: str, value: Any) -> RecordedField:
    if isinstance(value, Mapping):
        rows = [np.asarray(row) for row in value.values()]
        return RecordedField(name, "<f8", tuple(value), rows[0].shape if rows else ())
    return RecordedField(name, "<i8" if isinstance(value, (int, np.integer)) else "<f8")


@dataclass(frozen=True)
class RecordedSensor:
    """One sensor of the scene, or an obstacle or pin, which has the kind "driven".

    Attributes
    ----------
    number : in the recording; name : of the sensor; kind : one of `READINGS`
    shape : of its numbers; see `numbers` of the readings
    """

    number: int
    name: str
    kind: str
    shape: tuple[int, ...]

    @property
    def series_name(self) -> str:
        """For `Recording.frame_values`."""
        return f"sensors/{self.number}"

    @property
    def series(self) -> Series:
        return Series(f"supple/frames/{self.series_name}", 1, self.shape)

    @property
    def reading(self) -> type[Reading]:
        """The class of its readings."""
        return READINGS[self.kind]

    def columns(self, numbers: NDArray[np.float64]) -> Columns:
        """Columns of a table by name, of all frames' numbers."""
        prefix = self.name if self.kind == "driven" else f"sensors.{self.name}"
        return {f"{prefix}.{end}": column for end, column in self.reading.columns(numbers).items()}


def recorded_sensors(scene: Scene) -> tuple[RecordedSensor, ...]:
    """The sensors of a scene, then its obstacles and pins."""
    given = [(sensor.name, sensor.kind, READINGS[sensor.kind].shape_of(sensor)) for sensor in scene.sensors]
    driven = [(name, "driven", READINGS["driven"].shape) for name in driven_names(scene)]
    return tuple(RecordedSensor(k, *item) for k, item in enumerate([*given, *driven]))
