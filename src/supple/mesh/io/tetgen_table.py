"""One of TetGen's text files as a table of numbers: a header, then one line per row, `#` starts a comment."""

from __future__ import annotations

import codecs
import io
import re
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.errors import MeshError
from supple.mesh.io.text import file_contents

_COMMENT = re.compile(rb"#[^\n]*")
_WHOLE_NUMBER = re.compile(r"[+-]?[0-9]+")
_TEXT = bytes(range(32, 127)) + b"\t\n\v\f"


class Header(NamedTuple):
    """The text of a file, the line (1-based) of its header, and the header's whole numbers, the count of rows first."""

    path: Path
    text: bytes
    line: int
    values: list[int]

    def error(self, reason: str) -> MeshError:
        """`file:line: reason` for the header."""
        return MeshError(f"{self.path}:{self.line}: {reason}")


class Table(NamedTuple):
    """The rows (n, width) of one file below its header."""

    header: Header
    rows: NDArray[np.float64]

    def error(self, row: int, reason: str) -> MeshError:
        """`file:line: reason` for a row of the table."""
        lines = _filled_lines(self.header.text, after=self.header.line)
        line, _ = next(islice(lines, row, None), (self.header.line, ""))
        return MeshError(f"{self.header.path}:{line}: {reason}")

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


def _read_text(path: Path) -> bytes:
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


def read_header(path: Path, names: tuple[str, ...], defaults: tuple[int, ...]) -> Header:
    """The first filled line of a file, with missing numbers set to TetGen's defaults.

    `names` are the names of all of them. The first one, the count, has no default.
    """
    text = _read_text(path)
    number, line = next(_filled_lines(text), (0, ""))
    if not number:
        raise MeshError(f"{path}: it is empty; its first line must give {', '.join(names)}")
    words = line.split()
    if len(words) > len(names) or not all(_WHOLE_NUMBER.fullmatch(w) and len(w) <= 18 for w in words):
        raise MeshError(f"{path}:{number}: the header {_short(line)} is not whole numbers for {', '.join(names)}")
    values = [int(w) for w in words]
    if values[0] < 0:
        raise MeshError(f"{path}:{number}: the header announces {values[0]} rows")
    return Header(path, text, number, values + list(defaults[len(values) - 1 :]))


def read_rows(header: Header, width: int, meaning: str, extra: int = 0) -> Table:
    """The lines below the header as a table, each of them checked; memory is allocated only for what the file holds.

    `meaning` describes the `width` columns. Up to `extra` more columns at the end are ignored: TetGen's -nn appends
    neighbouring tets to faces and edges.
    """
    count = header.values[0]
    body = b"".join(header.text.split(b"\n", header.line)[header.line :])
    if count > body.count(b"\n") + 1:
        # The file is incomplete: report the line without parsing the numbers.
        _raise_for_bad_line(header, width, meaning, extra)
    try:
        rows = np.loadtxt(io.BytesIO(body), ndmin=2) if body.strip() else np.empty((0, width))
    except (ValueError, OverflowError):
        _raise_for_bad_line(header, width, meaning, extra)
        raise MeshError(f"{header.path}: cannot be read as a table of numbers") from None
    if len(rows) != count or not width <= rows.shape[1] <= width + extra:
        _raise_for_bad_line(header, width, meaning, extra)
    table = Table(header, rows)
    table.raise_where(~np.isfinite(rows).all(axis=1), "holds a number that is not finite")
    return table


def _raise_for_bad_line(header: Header, least: int, meaning: str, extra: int) -> None:
    """Raise for the first line that does not fit the header. Slow, so it is only called when something is wrong."""
    path, count = header.path, header.values[0]
    width = None
    rows, last = 0, header.line
    for last, line in _filled_lines(header.text, after=header.line):
        words = line.split()
        if rows == count:
            raise MeshError(f"{path}:{last}: one line too many: line {header.line} announces {count} in total")
        for word in words:
            if not _is_number(word):
                raise MeshError(f"{path}:{last}: {_short(word)} is not a number")
        if width is None and least <= len(words) <= least + extra:
            width = len(words)
        if len(words) != (width or least):
            raise MeshError(
                f"{path}:{last}: has {len(words)} values where the header (line {header.line}) announces "
                f"{width or least}: {meaning}"
            )
        rows += 1
    if rows < count:
        raise MeshError(
            f"{path}:{last}: the file ends after {rows} of the {count} rows that line {header.line} announces"
        )


def _filled_lines(text: bytes, after: int = 0) -> Iterator[tuple[int, str]]:
    """Number and content of each line that is not blank, after line number `after`."""
    for number, line in enumerate(io.BytesIO(text), start=1):
        if number > after and (content := line.strip()):
            yield number, content.decode("ascii")


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return "_" not in word


def _short(text: str) -> str:
    return repr(text if len(text) <= 40 else text[:37] + "...")
