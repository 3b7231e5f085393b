"""The fields that a recording can hold beside positions and velocities, by name."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from supple.errors import OutputError
from supple.kinds.suggestion import suggestion

# A recorded field has single precision: it is for pictures and tables, and positions have all digits.
NUMBER_BYTES = 4
_AT_VERTICES = "_at_vertices"


@dataclass(frozen=True)
class Field:
    """A quantity of tets or vertices.

    Attributes
    ----------
    name : in a recording
    at : what has a value of this `shape`: tets, vertices, or points that touch, which are vertices but for rigid bodies
    unit : "" where it has none
    """

    name: str
    at: Literal["tets", "vertices", "points"]
    shape: tuple[int, ...]
    unit: str

    def values(self, frame: Any) -> NDArray[np.float64]:
        """(m, ...) or (n, ...) of all bodies; NaN where a body has no such values."""
        source = getattr(frame, self.name.removesuffix(_AT_VERTICES))
        return source.at_vertices.values_of_all if self.name.endswith(_AT_VERTICES) else source.values_of_all

    def frame_bytes(self, vertices: int, tets: int) -> int:
        """What a frame of this many vertices and tets takes in a recording."""
        rows = tets if self.at == "tets" else vertices
        return NUMBER_BYTES * rows * int(np.prod(self.shape, dtype=np.int64))


_OF_TETS = (
    Field("stress", "tets", (3, 3), "Pa"),
    Field("first_piola", "tets", (3, 3), "Pa"),
    Field("von_mises", "tets", (), "Pa"),
    Field("principal_stretches", "tets", (3,), ""),
    Field("energy_density", "tets", (), "J/m^3"),
    Field("plastic_strain", "tets", (), ""),
    Field("dissipated_energy", "tets", (), "J/m^3"),
)
_OF_VERTICES = (
    *(Field(f"{field.name}{_AT_VERTICES}", "vertices", field.shape, field.unit) for field in _OF_TETS),
    Field("contact_force", "points", (3,), "N"),
    Field("contact_pressure", "points", (), "Pa"),
)
FIELDS = {field.name: field for field in (*_OF_TETS, *_OF_VERTICES)}


def checked_fields(names: Iterable[str]) -> tuple[Field, ...]:
    """The fields of these names.

    Raises
    ------
    OutputError : where none exists of a name, or a name occurs twice.
    """
    if isinstance(names, str):
        raise OutputError(f"fields is {names!r}; give a list of names, such as [{names!r}]")
    found: dict[str, Field] = {}
    for name in names:
        if name not in FIELDS:
            raise OutputError(f"fields: field {name!r} does not exist; {suggestion(str(name), list(FIELDS))}")
        if name in found:
            raise OutputError(f"fields: {name!r} is given twice; give it once")
        found[name] = FIELDS[name]
    return tuple(found.values())


def cost(fields: Iterable[Field], vertices: int, tets: int, frames: int) -> str:
    """What fields take in a recording of this many frames, as a line of text."""
    chosen = list(fields)
    frame_size = sum(field.frame_bytes(vertices, tets) for field in chosen)
    names = ", ".join(field.name for field in chosen)
    return f"{names}: {_size(frame_size)} for each frame, {_size(frame_size * frames)} for {frames} frames"


def _size(count: int) -> str:
    for unit, size in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if count >= size:
            return f"{count / size:.3g} {unit}"
    return f"{count} bytes"
