"""Files of material tests: tables of stretch and stress, and what testing machines write: travel and load.

Lines before the names of the columns are passed over. Columns are separated by commas, semicolons or tabs; with the
latter two, numbers may have a decimal comma. A unit stands in the name of a column, or in the line below the names.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.kinds.checks import number


@dataclass(frozen=True)
class Units:
    """What a file does not say of its numbers.

    Attributes
    ----------
    stress : one unit of stress [Pa]; None: what the column names, or 1 Pa
    area : of the specimen's section at rest [m^2]; length : between its clamps or marks at rest [m]
    """

    stress: float | None = None
    area: float | None = None
    length: float | None = None

    def __post_init__(self) -> None:
        for name, unit in (("stress", "Pa"), ("area", "m^2"), ("length", "m")):
            value = getattr(self, name)
            if value is not None and not 0.0 < number(value, name) < np.inf:
                raise SceneError(f"{name} is {value:g}; give a finite number above zero [{unit}]")


DEFAULT_UNITS = Units()
_PRESSURES = {
    "pa": 1.0,
    "kpa": 1e3,
    "mpa": 1e6,
    "gpa": 1e9,
    "psi": 6894.757293168361,
    "kg/cm2": 98066.5,
    "kg/cm^2": 98066.5,
}
_PRESSURES |= {"n/mm2": 1e6, "n/mm^2": 1e6, "n/mm\u00b2": 1e6}
_LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254, "inch": 0.0254}
_FORCES = {"n": 1.0, "kn": 1e3, "lbf": 4.4482216152605, "kgf": 9.80665, "gf": 9.80665e-3}
_SHARES = {"": 1.0, "-": 1.0, "%": 0.01, "mm/mm": 1.0, "m/m": 1.0, "in/in": 1.0}
# How columns begin, in the order in which they are preferred, and the units that they may have.
_FIRST = {
    "stretch": (("stretch", "lambda"), _SHARES),
    "strain": (("strain", "tensile strain", "nominal strain", "engineering strain"), _SHARES),
    "travel": (("extension", "displacement", "travel", "crosshead", "position", "elongation"), _LENGTHS),
}
_SECOND = {
    "stress": (("stress", "tensile stress", "nominal stress", "engineering stress"), _PRESSURES),
    "load": (("load", "force", "standard force"), _FORCES),
}


@dataclass(frozen=True)
class _Column:
    kind: str
    index: int
    unit: str


def read_test(path: Path, units: Units = DEFAULT_UNITS) -> NDArray[np.float64]:
    """Stretches and nominal stresses (k, 2) [-], [Pa] of a file.

    Raises
    ------
    SceneError : where the file cannot be read, lacks a column, has a unit that is not known, or needs area or length.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError:
        lines = path.read_text(encoding="latin-1").splitlines()
    except OSError as error:
        raise SceneError(f"{path}: cannot be read: {error.strerror or error}") from None
    kept = [(k, line) for k, line in enumerate(lines, 1) if line.strip() and not line.lstrip().startswith("#")]
    separator, (first, second), rows = _header(path, kept)
    below = _cells(rows[0][1], separator) if rows else []
    if rows and not any(_is_number(cell, separator) for cell in below):  # a line of units
        first, second = (replace(one, unit=one.unit or _unit(_cell(below, one.index))) for one in (first, second))
        rows = rows[1:]
    values = np.empty((len(rows), 2))
    for k, (line, text) in enumerate(rows):
        cells = _cells(text, separator)
        for j, one in enumerate((first, second)):
            try:
                values[k, j] = _number(_cell(cells, one.index), separator)
            except ValueError:
                raise SceneError(f"{path}:{line}: has no number in the column {one.kind}") from None
    return np.column_stack([_stretch(path, values[:, 0], first, units), _stress(path, values[:, 1], second, units)])


def _header(path: Path, lines: list[tuple[int, str]]) -> tuple[str, tuple[_Column, _Column], list[tuple[int, str]]]:
    """What separates columns, the two that are used, and the lines after their names."""
    for k, (_, line) in enumerate(lines):
        separator = max("\t;,", key=line.count)
        cells = _cells(line, separator)
        first, second = _column(cells, _FIRST), _column(cells, _SECOND)
        if first and second:
            return separator, (first, second), lines[k + 1 :]
    names = ", ".join(_cells(lines[0][1], max("\t;,", key=lines[0][1].count))) if lines else "of no name"
    raise SceneError(f"{path}: has the columns {names}; name two of them stretch and stress, or extension and load")


def _stretch(path: Path, values: NDArray[np.float64], column: _Column, units: Units) -> NDArray[np.float64]:
    values = values * _factor(path, column, _FIRST, None)
    if column.kind == "travel":
        if units.length is None:
            raise SceneError(f"{path}: has the travel of a machine; give the length of the specimen at rest [m]")
        values = values / units.length
    return values if column.kind == "stretch" else 1.0 + values


def _stress(path: Path, values: NDArray[np.float64], column: _Column, units: Units) -> NDArray[np.float64]:
    values = values * _factor(path, column, _SECOND, units.stress if column.kind == "stress" else None)
    if column.kind == "load":
        if units.area is None:
            raise SceneError(f"{path}: has the load of a machine; give the area of the specimen at rest [m^2]")
        values = values / units.area
    return values


def _factor(path: Path, column: _Column, kinds: dict, given: float | None) -> float:
    """What one unit of a column is in SI units."""
    known = kinds[column.kind][1]
    if given is not None:
        return given
    if column.unit.lower() in known:
        return known[column.unit.lower()]
    if not column.unit and column.kind == "stress":
        return 1.0
    has = f"the unit {column.unit!r}" if column.unit else "no unit"
    raise SceneError(f"{path}: the column {column.kind} has {has}; give one of {', '.join(filter(None, known))}")


def _cells(line: str, separator: str) -> list[str]:
    return [cell.strip().strip('"').strip() for cell in line.split(separator)]


def _cell(cells: list[str], index: int) -> str:
    return cells[index] if index < len(cells) else ""


def _column(cells: list[str], kinds: dict) -> _Column | None:
    for kind, (starts, _) in kinds.items():
        for index, cell in enumerate(cells):
            if cell.lower().startswith(starts):
                return _Column(kind, index, _unit(cell, named=True))
    return None


def _unit(cell: str, named: bool = False) -> str:
    """The unit in brackets after a name, or in a cell of its own."""
    unit = re.search(r"[\[(]\s*([^\])]*?)\s*[\])]", cell)
    return unit[1] if unit else "" if named else cell


def _is_number(cell: str, separator: str) -> bool:
    try:
        _number(cell, separator)
    except ValueError:
        return False
    return True


def _number(cell: str, separator: str) -> float:
    return float(cell.replace(",", ".") if separator != "," else cell)
