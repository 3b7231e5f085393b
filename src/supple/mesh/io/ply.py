"""Stanford PLY, ASCII and binary of either byte order."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import POLYGON, TRIANGLE_STRIP, Block, CellSoup, FormatError
from supple.mesh.io.text import integer, shortened, without_mark

SCALARS = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8", "int64": "i8", "uint64": "u8",
}  # fmt: skip
FACE_LISTS = ("vertex_indices", "vertex_index")
FACES = ("face", "tristrips")


class Property(NamedTuple):
    """A column of an element: a scalar, or a list with a length of type `length` before it."""

    name: str
    kind: str
    length: str | None = None


class Element(NamedTuple):
    """A table: its name, its number of rows, and its columns."""

    name: str
    count: int
    properties: list[Property]


def read(data: bytes) -> CellSoup:
    """Polygons and strips of triangles of a PLY file; other elements and columns are ignored."""
    data = without_mark(data)
    order, elements, start, line = _header(data)
    if order == "":  # text: its numbers are read as those of a binary file in double precision
        data, start, order = _numbers_of_text(data[start:], line), 0, "="
        elements = [
            e._replace(properties=[Property(p.name, "f8", p.length and "f8") for p in e.properties]) for e in elements
        ]
    body = _Body(data, start, order)
    points: NDArray[np.float64] | None = None
    blocks: list[Block] = []
    for element in elements:
        body.expect(element)
        if element.name == "vertex":
            points = body.points(element)
        elif element.name == "face":
            blocks.append((POLYGON, *body.lists(element)))
        elif element.name == "tristrips":
            blocks.append((TRIANGLE_STRIP, *_strips(*body.lists(element))))
        elif points is None or not blocks:
            body.lists(element)
    if points is None or not blocks:
        raise FormatError("it has no 'vertex' element with x, y, z, or no 'face' element: it has no surface")
    return CellSoup.of_blocks(points, blocks)


def _strips(sizes: NDArray[np.int64], flat: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Sizes and corners of strips, which end at the end of a list and at -1."""
    strip = np.repeat(np.arange(len(sizes)), sizes) + np.cumsum(flat < 0)
    _, which, counts = np.unique(strip[flat >= 0], return_inverse=True, return_counts=True)
    return counts[counts > 2], flat[flat >= 0][counts[which] > 2]


def _numbers_of_text(body: bytes, line: int) -> bytes:
    try:
        return np.array(body.split(), dtype=np.float64).tobytes()
    except ValueError:
        for number, text in enumerate(body.split(b"\n"), start=line + 1):
            try:
                np.array(text.split(), dtype=np.float64)
            except ValueError:
                shown = shortened(text.decode("utf-8", errors="replace").split())
                raise FormatError(f"'{shown}' holds something that is not a number", number) from None
        raise


def _header(data: bytes) -> tuple[str, list[Element], int, int]:
    """Byte order ('' for text), elements, and where the body starts: byte and line."""
    end = data.find(b"end_header")
    stop = data.find(b"\n", end)
    if not data.startswith(b"ply") or end < 0 or stop < 0:
        raise FormatError("it has no PLY header ('ply' ... 'end_header'): it is truncated, or not a PLY file", 1)
    order: str | None = None
    elements: list[Element] = []
    lines = data[:end].decode("latin-1").split("\n")
    for line, text in enumerate(lines, start=1):
        words = text.split()
        if not words or words[0] in ("ply", "comment", "obj_info"):
            continue
        if words[0] == "format" and len(words) > 1:
            order = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}.get(words[1])
        elif words[0] == "element" and len(words) == 3:
            count = integer(words[2], line, "element count")
            if count < 0 or count > len(data):
                raise FormatError(f"{count} rows of '{shortened(words[1:2])}' cannot be in {len(data)} bytes", line)
            elements.append(Element(words[1], count, []))
        elif words[0] == "property" and elements and len(words) in (3, 5):
            elements[-1].properties.append(_property(words, line))
        else:
            raise FormatError(f"'{shortened(words)}' does not belong in a PLY header", line)
    if order is None:
        raise FormatError("the format is none of ascii, binary_little_endian, binary_big_endian", 2)
    return order, elements, stop + 1, len(lines)


def _property(words: list[str], line: int) -> Property:
    is_list = words[1] == "list"
    kinds = words[2:4] if is_list else words[1:2]
    if len(words) != (5 if is_list else 3) or any(kind not in SCALARS for kind in kinds):
        raise FormatError(f"'{shortened(words)}' is an unknown property", line)
    length = SCALARS[kinds[0]] if is_list else None
    if length is not None and length.startswith("f"):
        raise FormatError("the length of a list must be an integer", line)
    return Property(words[-1], SCALARS[kinds[-1]], length)


def _columns(element: Element) -> list[int]:
    names = [p.name for p in element.properties]
    if any(p.length for p in element.properties):
        raise FormatError("vertices with lists cannot be read")
    if not {"x", "y", "z"} <= set(names):
        raise FormatError("its vertices have no x, y and z")
    return [names.index(axis) for axis in "xyz"]


def _which_list(element: Element) -> int:
    """The column with the corners of the faces; -1 where the element is not a face."""
    found = [k for k, p in enumerate(element.properties) if p.length and p.name in FACE_LISTS]
    if element.name in FACES and not found:
        raise FormatError("its faces have no list 'vertex_indices' or 'vertex_index'")
    return found[0] if found else -1


def _whole(values: NDArray) -> NDArray[np.int64]:
    if values.dtype.kind == "f" and not ((np.abs(values) < 2.0**53) & (values == np.floor(values))).all():
        raise FormatError("a length of a list, or an index of a face, is not a whole number")
    return values.astype(np.int64)


class _Body:
    def __init__(self, data: bytes, start: int, order: str) -> None:
        self.data, self.at, self.order = data, start, order

    def expect(self, element: Element) -> None:
        left = len(self.data) - self.at
        smallest_row = sum(np.dtype(p.length or p.kind).itemsize for p in element.properties)
        if element.count * smallest_row > left:
            raise FormatError(
                f"its header announces {element.count} rows of '{element.name}', but only {left // smallest_row} are "
                "left: it is truncated"
            )

    def points(self, element: Element) -> NDArray[np.float64]:
        columns = _columns(element)
        dtype = np.dtype([(f"c{k}", self.order + p.kind) for k, p in enumerate(element.properties)])
        table = np.frombuffer(self.data, dtype=dtype, count=element.count, offset=self.at)
        self.at += dtype.itemsize * element.count
        return np.column_stack([table[f"c{k}"].astype(np.float64) for k in columns])

    def lists(self, element: Element) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        column = _which_list(element)
        fast = self._equal_lists(element, column)
        return self._any_lists(element, column) if fast is None else fast

    def _equal_lists(self, element: Element, column: int) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
        """All rows at once, where each list is as long as in the first row; None where lengths differ."""
        columns, at = [], self.at
        lengths = {}
        for k, p in enumerate(element.properties):
            if p.length is not None and element.count:
                kind = np.dtype(self.order + p.length)
                if at + kind.itemsize > len(self.data):
                    return None
                lengths[k] = int(_whole(np.frombuffer(self.data, kind, 1, at))[0])
                if lengths[k] < 0 or lengths[k] > 64:
                    return None
                columns.append((f"n{k}", kind))
                columns.append((f"c{k}", self.order + p.kind, (lengths[k],)))
            else:
                columns.append((f"c{k}", self.order + p.kind))
            at = self.at + np.dtype(columns).itemsize
        dtype = np.dtype(columns)
        if dtype.itemsize * element.count > len(self.data) - self.at:
            return None
        table = np.frombuffer(self.data, dtype=dtype, count=element.count, offset=self.at)
        if any((table[f"n{k}"] != length).any() for k, length in lengths.items()):
            return None
        self.at += dtype.itemsize * element.count
        flat = _whole(table[f"c{column}"]).ravel() if column >= 0 else np.empty(0, dtype=np.int64)
        return np.full(element.count, lengths.get(column, 0), dtype=np.int64), flat

    def _any_lists(self, element: Element, column: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        sizes, pieces = [], []
        kinds = [
            (np.dtype(self.order + p.kind), None if p.length is None else np.dtype(self.order + p.length))
            for p in element.properties
        ]
        for row in range(element.count):
            for k, (kind, length) in enumerate(kinds):
                try:
                    size = 1
                    if length is not None:
                        size = int(_whole(np.frombuffer(self.data, length, 1, self.at))[0])
                        self.at += length.itemsize
                    if size < 0 or size * kind.itemsize > len(self.data) - self.at:
                        raise ValueError
                    values = np.frombuffer(self.data, kind, size, self.at)
                except ValueError:
                    raise FormatError(f"row {row} of '{element.name}' goes beyond the end of the file") from None
                self.at += size * kind.itemsize
                if k == column:
                    sizes.append(size)
                    pieces.append(values)
        flat = _whole(np.concatenate(pieces)) if pieces else np.empty(0, dtype=np.int64)
        return np.array(sizes, dtype=np.int64), flat


def written(vertices: NDArray[np.float64], triangles: NDArray[np.int32]) -> bytes:
    """Binary little-endian PLY in double precision."""
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment written by supple\n"
        f"element vertex {len(vertices)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.empty(len(triangles), dtype=np.dtype([("n", "u1"), ("corners", "<i4", 3)]))
    faces["n"] = 3
    faces["corners"] = triangles
    return header.encode() + np.asarray(vertices, dtype="<f8").tobytes() + faces.tobytes()
