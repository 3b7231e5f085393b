"""One of TetGen's text files as a table of numbers: a header, then one line per row, `#` starts a comment."""

from __future__ import annotations

import codecs
import io
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.errors import MeshError
from supple.mesh.io.file_contents import file_contents

_COMMENT = re.compile(rb"#[^\n]*")
_WHOLE_NUMBER = re.compile(r"[+-]?[0-9]+")
_TEXT = bytes(range(32, 127)) + b"\t\n\v\f"


class Columns(NamedTuple):
    """What the header of a file announces: number, width and meaning of the rows below it.

    Up to `extra` more columns at the end are ignored: TetGen's -nn appends neighbouring tets to faces and edges.
    """

    count: int
    width: int
    meaning: str
    extra: int = 0


@dataclass(frozen=True, eq=False)
class Table:
    """The rows (n, width) of one file, and the file's text, in which the line of a row can be found."""

    path: Path
    rows: NDArray[np.float64]
    text: bytes
    header_line: int

    def error(self, row: int, reason: str) -> MeshError:
        """`file:line: reason` for a row of the table."""
        for k, (line, _) in enumerate(_filled_lines(self.text, after=self.header_line)):
            if k == row:
                return MeshError(f"{self.path}:{line}: {reason}")
        return MeshError(f"{self.path}: {reason}")

    def raise_where(self, bad: NDArray[np.bool_] | np.bool_, reason: str, column: NDArray | None = None) -> None:
        """Raise for the first row marked in `bad`; `{}` in the reason becomes that row's value in `column`."""
        if bad.any():
            row = int(np.flatnonzero(bad)[0])
            raise self.error(row, reason if column is None else reason.format(f"{column[row]:.17g}"))

    def whole_numbers(self, columns: slice, what: str) -> NDArray[np.int64]:
        """Columns (n, k) that must hold integers of 32 bits."""
        block = self.rows[:, columns]
        for column in block.T:
            self.raise_where(column != np.rint(column), f"{what} {{}} is not a whole number", column)
            self.raise_where(np.abs(column) > 2**31 - 1, f"{what} {{}} does not fit into 32 bits", column)
        return block.astype(np.int64)


def read_text(path: Path) -> bytes:
    """A file's bytes with unix line ends, without comments; `MeshError` where it cannot be read or is not text."""
    data = file_contents(path).removeprefix(codecs.BOM_UTF8)
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if b"#" in data:
        data = _COMMENT.sub(b"", data)
    if data.translate(None, _TEXT):
        for number, line in enumerate(data.split(b"\n"), start=1):
            if odd := line.translate(None, _TEXT):
                raise MeshError(f"{path}:{number}: holds the byte 0x{odd[0]:02x}; this is not a text file of TetGen")
    return data


def read_header(path: Path, text: bytes, names: tuple[str, ...], defaults: tuple[int, ...]) -> tuple[list[int], int]:
    """The whole numbers of the first filled line, missing ones set to TetGen's defaults, and that line's number.

    `names` are the names of all of them. The first one, the count, has no default.
    """
    number, line = next(_filled_lines(text), (0, b""))
    if not number:
        raise MeshError(f"{path}: it is empty; its first line must give {', '.join(names)}")
    words = line.decode("ascii").split()
    if len(words) > len(names) or not all(_WHOLE_NUMBER.fullmatch(w) and len(w) <= 18 for w in words):
        raise MeshError(f"{path}:{number}: the header {_short(line)} is not whole numbers for {', '.join(names)}")
    values = [int(w) for w in words]
    if values[0] < 0:
        raise MeshError(f"{path}:{number}: the header announces {values[0]} rows")
    return values + list(defaults[len(values) - 1 :]), number


def read_rows(path: Path, text: bytes, header_line: int, columns: Columns) -> Table:
    """The lines below the header as a table, each of them checked; memory is allocated only for what the file holds."""
    start = _offset_after(text, header_line)
    held = text.count(b"\n", start) + 1
    if columns.count > held:
        # The file is incomplete: report the line without parsing the numbers.
        _raise_for_bad_line(path, text, header_line, columns)
    try:
        body = text[start:]
        rows = np.loadtxt(io.BytesIO(body), ndmin=2) if body.strip() else np.empty((0, columns.width))
    except (ValueError, OverflowError):
        _raise_for_bad_line(path, text, header_line, columns)
        raise MeshError(f"{path}: cannot be read as a table of numbers") from None
    width = rows.shape[1]
    if len(rows) != columns.count or not columns.width <= width <= columns.width + columns.extra:
        _raise_for_bad_line(path, text, header_line, columns)
    table = Table(path, rows, text, header_line)
    table.raise_where(~np.isfinite(rows).all(axis=1), "holds a number that is not finite")
    return table


def _raise_for_bad_line(path: Path, text: bytes, header_line: int, columns: Columns) -> None:
    """Raise for the first line that does not fit the header. Slow, so it is only called when something is wrong."""
    width = None
    rows, last = 0, header_line
    for last, line in _filled_lines(text, after=header_line):
        words = line.decode("ascii").split()
        if rows == columns.count:
            raise MeshError(f"{path}:{last}: one line too many: line {header_line} announces {columns.count} in total")
        for word in words:
            if not _is_number(word):
                raise MeshError(f"{path}:{last}: {_short(word)} is not a number")
        if width is None and columns.width <= len(words) <= columns.width + columns.extra:
            width = len(words)
        if len(words) != (width or columns.width):
            raise MeshError(
                f"{path}:{last}: has {len(words)} values where the header (line {header_line}) announces "
                f"{width or columns.width}: {columns.meaning}"
            )
        rows += 1
    if rows < columns.count:
        raise MeshError(
            f"{path}:{last}: the file ends after {rows} of the {columns.count} rows that line {header_line} announces"
        )


def _filled_lines(text: bytes, after: int = 0) -> Iterator[tuple[int, bytes]]:
    """Number and content of each line that is not blank, after line number `after`."""
    for number, line in enumerate(io.BytesIO(text), start=1):
        if number > after and (content := line.strip()):
            yield number, content


def _offset_after(text: bytes, line: int) -> int:
    offset = 0
    for _ in range(line):
        end = text.find(b"\n", offset)
        if end < 0:
            return len(text)
        offset = end + 1
    return offset


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return "_" not in word


def _short(word: str | bytes) -> str:
    text = word.decode("ascii", "replace") if isinstance(word, bytes) else word
    return repr(text if len(text) <= 40 else text[:37] + "...")
