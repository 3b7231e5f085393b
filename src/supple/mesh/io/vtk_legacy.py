"""Legacy VTK files (.vtk), text and binary, versions up to 5.1: PolyData and UnstructuredGrid.

Source: "VTK File Formats" of the VTK documentation; version 5.1 stores cells as offsets and connectivity.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import CELL_OF_WIDTH, POLYGON, TRIANGLE_STRIP, Block, CellSoup, FormatError
from supple.mesh.io.text import integer, shortened, without_mark

SCALARS = {
    "char": "i1", "unsigned_char": "u1", "short": "i2", "unsigned_short": "u2", "int": "i4", "unsigned_int": "u4",
    "long": "i8", "unsigned_long": "u8", "vtktypeint64": "i8", "vtkidtype": "i8", "float": "f4", "double": "f8",
}  # fmt: skip
# Cell type of each section of PolyData.
POLYDATA_SECTIONS = {"VERTICES": 2, "LINES": 4, "POLYGONS": POLYGON, "TRIANGLE_STRIPS": TRIANGLE_STRIP}


class _Cursor:
    """A position in the file, from which lines or arrays are read."""

    def __init__(self, data: bytes) -> None:
        self.data, self.at, self.line, self.text = data, 0, 0, True

    def next_line(self) -> str | None:
        """The next line, or None at the end."""
        if self.at >= len(self.data):
            return None
        end = self.data.find(b"\n", self.at)
        end = len(self.data) if end < 0 else end
        line = self.data[self.at : end]
        self.at, self.line = end + 1, self.line + 1
        return line.decode("latin-1").strip()

    def next_words(self) -> list[str]:
        """The words of the next line that is not blank; none at the end."""
        words: list[str] = []
        while not words and (line := self.next_line()) is not None:
            words = line.split()
        return words

    def array(self, count: int, kind: str, what: str) -> NDArray:
        """`count` numbers; text may spread over lines, binary is big-endian."""
        if count < 0 or count > len(self.data):
            raise FormatError(f"{count} numbers of {what} cannot be in a file of {len(self.data)} bytes", self.line)
        if not self.text:
            dtype = np.dtype(">" + kind)
            if count * dtype.itemsize > len(self.data) - self.at:
                raise FormatError(f"the file ends inside {what}: it is truncated")
            values = np.frombuffer(self.data, dtype, count, self.at)
            self.at += count * dtype.itemsize
            return values.astype(dtype.newbyteorder("="))
        words: list[str] = []
        first = self.line + 1
        while len(words) < count:
            line = self.next_line()
            if line is None:
                raise FormatError(
                    f"the file ends after {len(words)} of {count} numbers of {what}: it is truncated", self.line
                )
            words += line.split()
        try:
            return np.array(words[:count], dtype=np.float64 if kind.startswith("f") else np.int64)
        except (ValueError, OverflowError):
            raise FormatError(f"{what} holds something that is not a number", first) from None


def read(data: bytes) -> CellSoup:
    """Points and cells of a legacy VTK file; data on points and cells is ignored."""
    cursor = _Cursor(without_mark(data))
    first = cursor.next_line() or ""
    if not first.startswith("# vtk DataFile"):
        raise FormatError("it does not begin with '# vtk DataFile Version'; is it a legacy VTK file?", 1)
    cursor.next_line()
    encoding = (cursor.next_line() or "").upper()
    if encoding not in ("ASCII", "BINARY"):
        raise FormatError(f"'{shortened([encoding])}' should be ASCII or BINARY", 3)
    cursor.text = encoding == "ASCII"
    return _body(cursor)


def _body(cursor: _Cursor) -> CellSoup:
    points = np.empty((0, 3))
    types: NDArray | None = None
    blocks: list[Block] = []
    while words := cursor.next_words():
        section = words[0].upper()
        if section == "DATASET":
            if len(words) < 2 or words[1].upper() not in ("POLYDATA", "UNSTRUCTURED_GRID"):
                raise FormatError(f"'{shortened(words)}' is neither POLYDATA nor UNSTRUCTURED_GRID", cursor.line)
        elif section == "METADATA":
            while cursor.next_line():
                pass
        elif section == "POINTS":
            kind = SCALARS.get(words[2].lower()) if len(words) > 2 else None
            if kind is None:
                raise FormatError(f"'{shortened(words)}' should be 'POINTS n float' or double", cursor.line)
            count = integer(words[1], cursor.line, "point count")
            points = cursor.array(3 * count, kind, "the points").astype(np.float64).reshape(-1, 3)
        elif section in POLYDATA_SECTIONS or section == "CELLS":
            blocks.append((POLYDATA_SECTIONS.get(section, 0), *_cells(cursor, words)))
        elif section == "CELL_TYPES":
            count = integer(words[1] if len(words) > 1 else "", cursor.line, "cell count")
            types = cursor.array(count, "i4", "the cell types")
        elif section in ("POINT_DATA", "CELL_DATA"):
            break
        elif section == "FIELD":
            _skip_field(cursor, words)
        else:
            raise FormatError(f"'{shortened(words)}' is an unknown section", cursor.line)
    if len(points) == 0:
        raise FormatError("it has no points")
    if not blocks:
        raise FormatError("it has no cells")
    soup = CellSoup.of_blocks(points, blocks)
    if types is None:
        types = soup.types
    if len(types) != len(soup.types):
        raise FormatError(f"it has {len(soup.types)} cells, but {len(types)} cell types")
    if not types.all():
        raise FormatError("its cells have no CELL_TYPES")
    return soup._replace(types=types.astype(np.uint8))


def _cells(cursor: _Cursor, words: list[str]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Sizes and points of a block of cells, in either of the two layouts."""
    what = f"the section {words[0].upper()}"
    if len(words) < 3:
        raise FormatError(f"'{shortened(words)}' has fewer than two counts", cursor.line)
    n, size = integer(words[1], cursor.line, "cell count"), integer(words[2], cursor.line, "cell size")
    before, line_before = cursor.at, cursor.line
    following = (cursor.next_line() or "").split()
    if following and following[0].upper() == "OFFSETS":
        offsets = cursor.array(n, _kind(following, cursor), what).astype(np.int64)
        following = cursor.next_words()
        if not following or following[0].upper() != "CONNECTIVITY":
            raise FormatError(f"CONNECTIVITY is missing in {what}", cursor.line)
        flat = cursor.array(size, _kind(following, cursor), what).astype(np.int64)
        if n == 0:
            return offsets, flat[:0]
        if offsets[0] != 0 or offsets[-1] != len(flat) or (np.diff(offsets) < 0).any():
            raise FormatError(f"the offsets of {what} contradict its size")
        return np.diff(offsets), flat
    cursor.at, cursor.line = before, line_before
    # Cells one after the other, each as its size and its points.
    packed = cursor.array(size, "i4", what).astype(np.int64)
    if n > len(packed) or n < 0:
        raise FormatError(f"{what} announces {n} cells in {len(packed)} numbers")
    sizes = np.empty(n, dtype=np.int64)
    if n and len(packed) == n * (packed[0] + 1) and (packed[:: packed[0] + 1] == packed[0]).all():
        sizes[:] = packed[0]
    else:
        at = 0
        for k in range(n):
            if at >= len(packed) or packed[at] < 0:
                raise FormatError(f"cell {k} of {what} has no valid size")
            sizes[k] = packed[at]
            at += int(packed[at]) + 1
        if at != len(packed):
            raise FormatError(f"the cells of {what} do not fill its {len(packed)} numbers")
    heads = np.cumsum(sizes + 1) - sizes - 1
    return sizes, np.delete(packed, heads)


def _kind(words: list[str], cursor: _Cursor) -> str:
    kind = SCALARS.get(words[1].lower()) if len(words) > 1 else None
    if kind is None or kind.startswith("f"):
        raise FormatError(f"'{shortened(words)}' is not an integer type", cursor.line)
    return kind


def _skip_field(cursor: _Cursor, words: list[str]) -> None:
    """Field data before the geometry (time values and the like)."""
    count = integer(words[2] if len(words) > 2 else "", cursor.line, "number of field arrays")
    for _ in range(count):
        head = cursor.next_words()
        kind = SCALARS.get(head[3].lower()) if len(head) == 4 else None
        if kind is None:
            raise FormatError(f"field array '{shortened(head)}' cannot be read", cursor.line)
        size = integer(head[1], cursor.line, "size") * integer(head[2], cursor.line, "size")
        cursor.array(size, kind, "a field")


def written_surface(vertices: NDArray[np.float64], triangles: NDArray[np.int32]) -> bytes:
    """PolyData as binary legacy VTK 3.0, which all readers support."""
    return _written("POLYDATA", vertices, "POLYGONS", triangles)


def written_cells(vertices: NDArray[np.float64], cells: NDArray[np.int32]) -> bytes:
    """Triangles or tets as an UnstructuredGrid in binary legacy VTK 3.0."""
    m, width = cells.shape
    types = np.full(m, CELL_OF_WIDTH[width], dtype=">i4").tobytes()
    return _written("UNSTRUCTURED_GRID", vertices, "CELLS", cells) + f"CELL_TYPES {m}\n".encode() + types + b"\n"


def _written(dataset: str, vertices: NDArray[np.float64], section: str, cells: NDArray[np.int32]) -> bytes:
    m, width = cells.shape
    head = f"# vtk DataFile Version 3.0\nwritten by supple\nBINARY\nDATASET {dataset}\nPOINTS {len(vertices)} double\n"
    packed = np.column_stack([np.full(m, width), cells]).astype(">i4")
    points = vertices.astype(">f8").tobytes()
    return head.encode() + points + f"\n{section} {m} {packed.size}\n".encode() + packed.tobytes() + b"\n"
