"""Gmsh's .msh: reads versions 2, 4.0 and 4.1, text and binary; writes 4.1 through meshio.

Source: the Gmsh reference manual, "MSH file format". Node tags may be any numbers in any order, so they are found
by sorting: memory depends on the size of the file, never on the numbers in it.
"""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import QUADRATIC_TETRA, Block, CellSoup, FormatError
from supple.mesh.io.text import without_mark

# Gmsh's element types: nodes, and VTK's number for the same cell.
ELEMENTS = {
    1: (2, 3), 2: (3, 5), 3: (4, 9), 4: (4, 10), 5: (8, 12), 6: (6, 13), 7: (5, 14), 8: (3, 21), 9: (6, 22),
    10: (9, 28), 11: (10, 24), 12: (27, 29), 13: (18, 32), 14: (14, 27), 15: (1, 1), 16: (8, 23), 17: (20, 25),
    18: (15, 26), 19: (13, 27),
}  # fmt: skip


# Gmsh numbers the last two edges of a quadratic tet the other way round; see the manual, "Node ordering".
GMSH_TO_VTK = np.array([0, 1, 2, 3, 4, 5, 6, 7, 9, 8])


class Form(NamedTuple):
    version: str
    is_text: bool
    size_bytes: int
    order: str


class Section:
    """The numbers between $Name and $EndName, read one group after another."""

    def __init__(self, data: bytes, name: str, form: Form) -> None:
        self.name, self.form, self.data = name, form, data
        found = re.search(rb"^\$" + name.encode() + rb"[ \t]*\r?\n", data, re.MULTILINE)
        if found is None:
            raise FormatError(f"it has no section ${name}: it is truncated, or has no mesh")
        self.at = found.end()
        self.values = np.empty(0)
        line = data.count(b"\n", 0, found.end()) + 1
        self.line = line if form.is_text else None
        if form.is_text:
            end = data.find(b"$End" + name.encode(), found.end())
            if end < 0:
                raise FormatError(f"it has no $End{name}: it is truncated")
            self.values = self._parsed(data[found.end() : end], line)
            self.at = 0

    def _parsed(self, text: bytes, first: int) -> NDArray[np.float64]:
        words = text.split()
        try:
            return np.array(words, dtype=np.float64)
        except ValueError:
            for number, line in enumerate(text.split(b"\n"), start=first):
                try:
                    np.array(line.split(), dtype=np.float64)
                except ValueError:
                    raise FormatError(f"${self.name} holds something that is not a number", number) from None
            raise FormatError(f"${self.name} holds something that is not a number", first) from None

    def _short(self, count: int) -> FormatError:
        announced = f"the {count} numbers that its counts announce"
        return FormatError(f"${self.name} does not hold {announced}: it is truncated or damaged", self.line)

    def _taken(self, count: int) -> NDArray[np.float64]:
        if count < 0 or count > len(self.values) - self.at:
            raise self._short(count)
        self.at += count
        return self.values[self.at - count : self.at]

    def _binary(self, dtype: np.dtype, count: int) -> NDArray:
        if count < 0 or count * dtype.itemsize > len(self.data) - self.at:
            raise self._short(count)
        values = np.frombuffer(self.data, dtype, count, self.at)
        self.at += count * dtype.itemsize
        return values

    def first_count(self) -> int:
        """The count on the first line of a section of version 2, which is text in binary files too."""
        if self.form.is_text:
            return int(self.integers(1)[0])
        end = self.data.find(b"\n", self.at)
        word = self.data[self.at : end].strip()
        if end < 0 or not word.isdigit() or len(word) > 18:
            raise FormatError(f"${self.name} does not begin with a count")
        self.at = end + 1
        return int(word)

    def integers(self, count: int, size: int = 4) -> NDArray[np.int64]:
        """Whole numbers, of `size` bytes each in binary files."""
        if not self.form.is_text:
            return self._binary(np.dtype(f"{self.form.order}i{size}"), count).astype(np.int64)
        values = self._taken(count)
        if not (np.abs(values) < 2.0**53).all() or (values != np.floor(values)).any():
            raise FormatError(f"${self.name} holds a number that should be a whole number")
        return values.astype(np.int64)

    def floats(self, count: int) -> NDArray[np.float64]:
        """Coordinates."""
        if self.form.is_text:
            return self._taken(count)
        return self._binary(np.dtype(f"{self.form.order}f8"), count).astype(np.float64)

    def tagged(self, count: int, width: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Rows of a 4-byte tag and `width` coordinates."""
        if self.form.is_text:
            table = self._taken(count * (width + 1)).reshape(count, width + 1)
            with np.errstate(invalid="ignore"):
                return table[:, 0].astype(np.int64), table[:, 1:]
        dtype = np.dtype([("tag", f"{self.form.order}i4"), ("x", f"{self.form.order}f8", (width,))])
        table = self._binary(dtype, count)
        return table["tag"].astype(np.int64), table["x"].astype(np.float64)

    def text_elements(self, count: int) -> list[tuple[int, NDArray[np.int64]]]:
        """Version 2's rows of differing length: number, type, number of tags, tags, nodes."""
        values = self.integers(len(self.values) - self.at)
        at, rows = 0, []
        for _ in range(count):
            if at + 3 > len(values):
                raise self._short(count)
            kind, tags = int(values[at + 1]), int(values[at + 2])
            nodes = nodes_of_kind(kind)
            start = at + 3 + tags
            at = start + nodes
            if tags < 0 or at > len(values):
                raise self._short(count)
            rows.append((kind, start))
        starts = {k: np.array([s for kind, s in rows if kind == k]) for k in sorted({kind for kind, _ in rows})}
        return [(k, values[s[:, None] + np.arange(nodes_of_kind(k))]) for k, s in starts.items()]


def read(data: bytes) -> CellSoup:
    """Points and cells of a .msh file; physical groups and data are ignored."""
    data = without_mark(data)
    form = file_form(data)
    tags, points = _nodes(data, form)
    blocks = (_elements_2 if form.version == "2" else _elements_4)(Section(data, "Elements", form))
    if len(tags) == 0:
        raise FormatError("it has no nodes")
    order = np.argsort(tags, kind="stable")
    ordered = tags[order]
    if (ordered[1:] == ordered[:-1]).any():
        tag = ordered[:-1][ordered[1:] == ordered[:-1]][0]
        raise FormatError(f"node {tag} is given twice")
    cells: list[Block] = []
    for kind, nodes in blocks:
        place = np.minimum(np.searchsorted(ordered, nodes), len(ordered) - 1)
        unknown = ordered[place] != nodes
        if unknown.any():
            raise FormatError(f"an element names node {nodes[unknown][0]}, which does not exist")
        size, cell_type = ELEMENTS[kind]
        found = order[place]
        if cell_type == QUADRATIC_TETRA:
            found = found[:, GMSH_TO_VTK]
        cells.append((cell_type, np.full(len(nodes), size), found.ravel()))
    if not cells:
        raise FormatError("it has no elements")
    return CellSoup.of_blocks(points, cells)


def _nodes(data: bytes, form: Form) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Tags (n,) and coordinates (n, 3) of the nodes, in the order of the file."""
    first = Section(data, "Nodes", form)
    return first.tagged(first.first_count(), 3) if form.version == "2" else _nodes_4(first)


def node_tags(data: bytes, form: Form) -> NDArray[np.int64]:
    """(n,) in the order of the file."""
    return _nodes(data, form)[0]


def file_form(data: bytes) -> Form:
    head = re.match(
        rb"\s*(?:\$Comments.*?\$EndComments\s*)?\$MeshFormat\s+(\S+)\s+([01])\s+(\d+)[^\n]*\n", data, re.DOTALL
    )
    if head is None:
        raise FormatError("it does not begin with '$MeshFormat'; is it a Gmsh file?", 1)
    given = head.group(1).decode("latin-1")
    version = {"4": "4.1", "4.1": "4.1", "4.0": "4.0"}.get(given, "2" if given in ("2", "2.0", "2.1", "2.2") else "")
    if not version:
        text = given if given.isprintable() else "?"
        raise FormatError(f"version '{text[:20]}' is not supported; save it as version 4.1 or 2.2")
    size = head.group(3)
    if size not in (b"4", b"8"):
        raise FormatError("the size of its numbers is neither 4 nor 8 bytes")
    is_text = head.group(2) == b"0"
    order = "<" if is_text or data[head.end() : head.end() + 4] == b"\x01\0\0\0" else ">"
    return Form(version, is_text, int(size), order)


def nodes_of_kind(kind: int) -> int:
    if kind not in ELEMENTS:
        raise FormatError(
            f"it holds elements of type {kind}; only tetrahedra of 4 or 10 nodes can be used: convert or remesh it"
        )
    return ELEMENTS[kind][0]


def _nodes_4(section: Section) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    size, is_40 = section.form.size_bytes, section.form.version == "4.0"
    blocks = int(section.integers(2 if is_40 else 4, size)[0])
    tags, points = [np.empty(0, dtype=np.int64)], [np.empty((0, 3))]
    for _ in range(blocks):
        first, second, parametric = (int(v) for v in section.integers(3))
        # An entity's dimension and tag come in either order; a parametric node has a coordinate for each dimension.
        width = 3 + (second if is_40 else first) if parametric else 3
        if not 3 <= width <= 6:
            raise FormatError(f"a block of $Nodes has dimension {width - 3}")
        count = int(section.integers(1, size)[0])
        if is_40:
            tag, x = section.tagged(count, width)
        else:
            tag, x = section.integers(count, size), section.floats(count * width).reshape(-1, width)
        tags.append(tag)
        points.append(x[:, :3])
    return np.concatenate(tags), np.concatenate(points)


def _elements_2(section: Section) -> list[tuple[int, NDArray[np.int64]]]:
    count = section.first_count()
    if section.form.is_text:
        return section.text_elements(count)
    blocks = []
    while count > 0:
        kind, n, tags = (int(v) for v in section.integers(3))
        if n < 1 or tags < 0:
            raise FormatError("a block of $Elements has no valid count")
        width = 1 + tags + nodes_of_kind(kind)
        blocks.append((kind, section.integers(n * width).reshape(n, width)[:, 1 + tags :]))
        count -= n
    return blocks


def _elements_4(section: Section) -> list[tuple[int, NDArray[np.int64]]]:
    size, is_40 = section.form.size_bytes, section.form.version == "4.0"
    blocks = []
    for _ in range(int(section.integers(2 if is_40 else 4, size)[0])):
        kind = int(section.integers(3)[2])
        n, width = int(section.integers(1, size)[0]), 1 + nodes_of_kind(kind)
        blocks.append((kind, section.integers(n * width, 4 if is_40 else size).reshape(-1, width)[:, 1:]))
    return blocks


def write(path: Path, vertices: NDArray[np.float64], tets: NDArray[np.int32]) -> None:
    """Version 4.1, binary."""
    import meshio

    with contextlib.redirect_stderr(io.StringIO()):
        kind = "tetra" if tets.shape[1] == 4 else "tetra10"
        mesh = meshio.Mesh(np.array(vertices), [(kind, np.array(tets))])
        meshio.gmsh.write(str(path), mesh, fmt_version="4.1", binary=True)
