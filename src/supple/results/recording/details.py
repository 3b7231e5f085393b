"""What a recording keeps of the solver's details: one series of fixed size for each field that `SolverDetails` keeps.

A number is one value, with NaN for None. A mapping is one row for each of its names, in an order that the header gives.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.model.state import SolverDetails
from supple.results.recording.checked_hdf5 import CheckedFile
from supple.results.recording.file import Series


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
    dtype: str
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
    """The class of a recording's details, and how each of its fields is stored."""

    kind: type[SolverDetails] = SolverDetails
    fields: tuple[RecordedField, ...] = ()

    @classmethod
    def like(cls, details: SolverDetails) -> RecordedDetails:
        """For details with the names and shapes of these. Of a class from outside of Supple, the known base is kept."""
        known = _kinds().values()
        kind = next(base for base in type(details).__mro__ if base in known)
        kept = [field.name for field in fields(kind) if field.compare]
        return cls(kind, tuple(_field_like(name, getattr(details, name)) for name in kept))

    @classmethod
    def from_header(cls, file: CheckedFile, header: dict[str, Any]) -> RecordedDetails:
        """What the header of a recording describes."""
        try:
            kind = _kinds()[header["details"]["kind"]]
            known = {field.name for field in fields(kind) if field.compare}
            made = cls(kind, tuple(_field_of(described) for described in header["details"]["fields"]))
        except (KeyError, TypeError, ValueError):
            raise file.broken("the solver's details in its header are not described as they should be") from None
        if not {field.name for field in made.fields} <= known:
            raise file.of_another_version(f"{kind.__name__} has an unknown field")
        return made

    def header(self) -> dict[str, Any]:
        """The description, as JSON can hold it."""
        return {"kind": self.kind.__name__, "fields": [vars(field) for field in self.fields]}

    def of_frame(self, number: int, series: Callable[[str], NDArray[Any]]) -> SolverDetails:
        """The details of one frame; `series` returns all frames' rows of the series at a path."""
        return self.kind(**{field.name: field.loaded(series(field.series.path)[number]) for field in self.fields})


def _field_like(name: str, value: Any) -> RecordedField:
    if isinstance(value, Mapping):
        rows = [np.asarray(row) for row in value.values()]
        return RecordedField(name, "<f8", tuple(value), rows[0].shape if rows else ())
    return RecordedField(name, "<i8" if isinstance(value, (int, np.integer)) else "<f8")


def _field_of(described: dict[str, Any]) -> RecordedField:
    name, dtype, keys, row_shape = (described[key] for key in ("name", "dtype", "keys", "row_shape"))
    if dtype not in ("<i8", "<f8") or row_shape not in ([], [3]) or not (keys is None or isinstance(keys, list)):
        raise ValueError
    return RecordedField(str(name), dtype, None if keys is None else tuple(map(str, keys)), tuple(row_shape))
