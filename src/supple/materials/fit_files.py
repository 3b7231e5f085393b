"""Files of tests: tables of stretch and stress, and what testing machines and cameras write.

Lines before the names of the columns are passed over, and comments. Columns are separated by commas, semicolons or
tabs; with the latter two, numbers may have a decimal comma. A unit stands in the name of a column, or in the line below
the names.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.kinds.checks import number

PRESSURES = {
    "pa": 1.0,
    "kpa": 1e3,
    "mpa": 1e6,
    "gpa": 1e9,
    "psi": 6894.757293168361,
    "kg/cm2": 98066.5,
    "kg/cm^2": 98066.5,
}
PRESSURES |= {"n/mm2": 1e6, "n/mm^2": 1e6, "n/mm\u00b2": 1e6}
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254, "inch": 0.0254}
FORCES = {"n": 1.0, "kn": 1e3, "lbf": 4.4482216152605, "kgf": 9.80665, "gf": 9.80665e-3}
TIMES = {"s": 1.0, "ms": 1e-3, "min": 60.0}
SHARES = {"": 1.0, "-": 1.0, "%": 0.01, "mm/mm": 1.0, "m/m": 1.0, "in/in": 1.0}


@dataclass(frozen=True)
class Table:
    """The columns of a file.

    Attributes
    ----------
    names, units : of the columns; rows : the cells below, each with the number of its line, from 1
    """

    path: Path
    separator: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    rows: tuple[tuple[int, list[str]], ...]

    @classmethod
    def read(cls, path: Path, is_header: Callable[[Sequence[str]], bool], expected: str) -> Table:
        """The table below the first line that is a header.

        Raises
        ------
        SceneError : where the file cannot be read, or no line is; the text then says what was `expected`.
        """
        try:
            lines = path.read_text(encoding="utf-8-sig").splitlines()
        except UnicodeDecodeError:
            lines = path.read_text(encoding="latin-1").splitlines()
        except OSError as error:
            raise SceneError(f"{path}: cannot be read: {error.strerror or error}") from None
        kept = [(k, line) for k, line in enumerate(lines, 1) if line.strip() and not line.lstrip().startswith("#")]
        for k, (_, line) in enumerate(kept):
            separator = max("\t;,", key=line.count)
            names = _cells(line, separator)
            if not is_header([name.lower() for name in names]):
                continue
            rows = [(number, _cells(text, separator)) for number, text in kept[k + 1 :]]
            units = [_unit(name, named=True) for name in names]
            if rows and not any(_is_number(cell, separator) for cell in rows[0][1]):  # a line of units
                below = rows.pop(0)[1]
                units = [unit or _unit(_cell(below, i)) for i, unit in enumerate(units)]
            return cls(path, separator, tuple(names), tuple(units), tuple(rows))
        names = ", ".join(_cells(kept[0][1], max("\t;,", key=kept[0][1].count))) if kept else "of no name"
        raise SceneError(f"{path}: has the columns {names}; {expected}")

    def place(self, *starts: str) -> int:
        """The number of the first column whose name begins so."""
        found = column(self.names, starts)
        assert found is not None
        return found

    def texts(self, index: int) -> list[str]:
        """The cells of a column."""
        return [_cell(cells, index) for _, cells in self.rows]

    def numbers(
        self, index: int, what: str, known: Mapping[str, float], *, default: str | None = None, gaps: bool = False
    ) -> NDArray[np.float64]:
        """(k,) the numbers of a column in SI units.

        Parameters
        ----------
        what : the column in messages; known : the units that it may have, with their sizes in SI units
        default : the unit of a column that names none; None: it has to name one
        gaps : whether cells may be empty, which gives NaN

        Raises
        ------
        SceneError : where a cell is not a number, or the unit is not known.
        """
        unit = self.units[index] or default
        if unit is None or unit.lower() not in known:
            has = f"the unit {unit!r}" if unit else "no unit"
            raise SceneError(f"{self.path}: the column {what} has {has}; give one of {', '.join(filter(None, known))}")
        values = np.empty(len(self.rows))
        for k, (line, cells) in enumerate(self.rows):
            cell = _cell(cells, index)
            try:
                values[k] = np.nan if gaps and not cell else _number(cell, self.separator)
            except ValueError:
                raise SceneError(f"{self.path}:{line}: has no number in the column {what}") from None
        return values * known[unit.lower()]


def column(names: Sequence[str], starts: tuple[str, ...]) -> int | None:
    """The first column whose name begins so."""
    return next((k for k, name in enumerate(names) if name.lower().startswith(starts)), None)


def _cells(line: str, separator: str) -> list[str]:
    return [cell.strip().strip('"').strip() for cell in line.split(separator)]


def _cell(cells: list[str], index: int) -> str:
    return cells[index] if index < len(cells) else ""


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
# How columns begin, in the order in which they are preferred.
TRAVEL = ("extension", "displacement", "travel", "crosshead", "position", "elongation")
LOAD = ("load", "force", "standard force")
_FIRST = {
    "stretch": ("stretch", "lambda"),
    "strain": ("strain", "tensile strain", "nominal strain", "engineering strain"),
    "travel": TRAVEL,
}
_SECOND = {"stress": ("stress", "tensile stress", "nominal stress", "engineering stress"), "load": LOAD}


def read_test(path: Path, units: Units = DEFAULT_UNITS) -> NDArray[np.float64]:
    """Stretches and nominal stresses (k, 2) [-], [Pa] of a file.

    Raises
    ------
    SceneError : where the file cannot be read, lacks a column, has a unit that is not known, or needs area or length.
    """
    table = Table.read(
        path,
        lambda names: bool(_found(names, _FIRST) and _found(names, _SECOND)),
        "name two of them stretch and stress, or extension and load",
    )
    (first, k), (second, j) = (found for kinds in (_FIRST, _SECOND) if (found := _found(table.names, kinds)))
    stretch = table.numbers(
        k, first, LENGTHS if first == "travel" else SHARES, default=None if first == "travel" else ""
    )
    if first == "travel":
        if units.length is None:
            raise SceneError(f"{path}: has the travel of a machine; give the length of the specimen at rest [m]")
        stretch = stretch / units.length
    if second == "load":
        force = table.numbers(j, second, FORCES)
        if units.area is None:
            raise SceneError(f"{path}: has the load of a machine; give the area of the specimen at rest [m^2]")
        stress = force / units.area
    elif units.stress is not None:
        stress = table.numbers(j, second, {table.units[j].lower(): units.stress}, default="")
    else:
        stress = table.numbers(j, second, PRESSURES, default="Pa")
    return np.column_stack([stretch if first == "stretch" else 1.0 + stretch, stress])


def _found(names: Sequence[str], kinds: dict[str, tuple[str, ...]]) -> tuple[str, int] | None:
    """The kind of the first column that is one of them, and its number."""
    places = ((kind, column(names, starts)) for kind, starts in kinds.items())
    return next(((kind, k) for kind, k in places if k is not None), None)
