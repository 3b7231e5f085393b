"""Physical groups of Gmsh's .msh, versions 2 and 4.1, text and binary.

Source: the Gmsh reference manual, "MSH file format". In version 2 each element has the number of its group; in version
4, the entity to which it belongs.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import FormatError
from supple.mesh.io.models.named_sets import NamedSets
from supple.mesh.io.msh import Form, Section, file_form, node_tags, nodes_of_kind
from supple.mesh.io.text import without_mark

_DIMENSION = {
    15: 0,
    1: 1,
    8: 1,
    2: 2,
    3: 2,
    9: 2,
    10: 2,
    16: 2,
    4: 3,
    5: 3,
    6: 3,
    7: 3,
    11: 3,
}  # by Gmsh's element type
_TET, _QUADRATIC_TET = 4, 11


class _Elements(NamedTuple):
    """Elements of one type: nodes' tags (n, width), and numbers of groups (n, k), 0 where there is none."""

    kind: int
    nodes: NDArray[np.int64]
    groups: NDArray[np.int64]

    def of_group(self, number: int) -> NDArray[np.int64]:
        """Rows of the elements of a group."""
        return np.flatnonzero((self.groups == number).any(axis=1))


def read(data: bytes) -> NamedSets:
    """The physical groups of a file."""
    data = without_mark(data)
    form = file_form(data)
    if form.version == "4.0":
        raise FormatError("groups of version 4.0 cannot be read; save it as version 4.1 or 2.2")
    tags = node_tags(data, form)
    order = np.argsort(tags, kind="stable")
    ordered = tags[order]
    names = _names(data)
    groups = _groups_of_entities(data, form) if names and form.version != "2" else {}
    blocks = list(_elements_2(data, form) if form.version == "2" else _elements_4(data, form, groups))
    kind = _TET if any(block.kind == _TET for block in blocks) else _QUADRATIC_TET
    solid = [block for block in blocks if block.kind == kind]
    if not solid:
        raise FormatError("it has no tetrahedra")
    if not len(ordered):
        raise FormatError("it has no nodes")

    def places(nodes: NDArray[np.int64]) -> NDArray[np.int64]:
        found = np.minimum(np.searchsorted(ordered, nodes), len(ordered) - 1)
        if (ordered[found] != nodes).any():
            raise FormatError(f"an element names node {nodes[ordered[found] != nodes].flat[0]}, which does not exist")
        return order[found]

    tets = np.concatenate([places(block.nodes) for block in solid])
    starts = np.cumsum([0, *(len(block.nodes) for block in solid)])
    node_sets: dict[str, NDArray[np.int64]] = {}
    tet_sets: dict[str, NDArray[np.int64]] = {}
    for (dimension, number), name in names.items():
        if dimension == 3:
            inside = [start + block.of_group(number) for start, block in zip(starts[:-1], solid, strict=True)]
            rows = np.concatenate(inside)
            if len(rows):
                tet_sets[name] = rows
        members = [
            places(block.nodes[block.of_group(number)]).ravel()
            for block in blocks
            if _DIMENSION.get(block.kind) == dimension
        ]
        nodes = np.unique(np.concatenate([np.empty(0, dtype=np.int64), *members]))
        if len(nodes) and (dimension < 3 or name not in node_sets):
            node_sets[name] = nodes
    return NamedSets(len(tags), tets, node_sets, tet_sets)


def _names(data: bytes) -> dict[tuple[int, int], str]:
    """Names by dimension and number; the section is text in binary files, too."""
    found = re.search(rb"^\$PhysicalNames[ \t]*\r?\n(.*?)^\$EndPhysicalNames", data, re.MULTILINE | re.DOTALL)
    if found is None:
        return {}
    names = {}
    for line in found[1].split(b"\n")[1:]:
        row = re.fullmatch(rb'\s*([0-3])\s+(\d{1,9})\s+"([^"]*)"\s*', line)
        if row is not None:
            names[int(row[1]), int(row[2])] = row[3].decode("utf-8", errors="replace")
    return names


def _elements_2(data: bytes, form: Form) -> Iterator[_Elements]:
    section = Section(data, "Elements", form)
    count = section.first_count()
    if section.form.is_text:
        values = section.integers(len(section.values) - section.at)
        at = 0
        rows: dict[int, list[tuple[int, int]]] = {}
        for _ in range(count):
            if at + 3 > len(values):
                raise FormatError("$Elements is shorter than its count: it is truncated")
            kind, tags = int(values[at + 1]), int(values[at + 2])
            end = at + 3 + tags + nodes_of_kind(kind)
            if tags < 0 or end > len(values):
                raise FormatError("$Elements is shorter than its count: it is truncated")
            rows.setdefault(kind, []).append((int(values[at + 3]) if tags else 0, at + 3 + tags))
            at = end
        for kind in sorted(rows):
            starts = np.array([start for _, start in rows[kind]])
            nodes = values[starts[:, None] + np.arange(nodes_of_kind(kind))]
            yield _Elements(kind, nodes, np.array([[group] for group, _ in rows[kind]]))
        return
    while count > 0:
        kind, n, tags = (int(v) for v in section.integers(3))
        if n < 1 or tags < 0:
            raise FormatError("a block of $Elements has no valid count")
        table = section.integers(n * (1 + tags + nodes_of_kind(kind))).reshape(n, -1)
        groups = table[:, 1:2] if tags else np.zeros((n, 1), dtype=np.int64)
        yield _Elements(kind, table[:, 1 + tags :], groups)
        count -= n


def _elements_4(data: bytes, form: Form, groups: Mapping[tuple[int, int], list[int]]) -> Iterator[_Elements]:
    section = Section(data, "Elements", form)
    size = section.form.size_bytes
    for _ in range(int(section.integers(4, size)[0])):
        dimension, entity, kind = (int(v) for v in section.integers(3))
        n, width = int(section.integers(1, size)[0]), 1 + nodes_of_kind(kind)
        nodes = section.integers(n * width, size).reshape(-1, width)[:, 1:]
        own = groups.get((dimension, entity)) or [0]
        yield _Elements(kind, nodes, np.broadcast_to(np.array(own), (len(nodes), len(own))))


def _groups_of_entities(data: bytes, form: Form) -> dict[tuple[int, int], list[int]]:
    """Numbers of the groups of each entity, by its dimension and tag."""
    section = Section(data, "Entities", form)
    size = section.form.size_bytes
    groups = {}
    for dimension, count in enumerate(section.integers(4, size).tolist()):
        for _ in range(count):
            tag = int(section.integers(1)[0])
            section.floats(3 if dimension == 0 else 6)
            groups[dimension, tag] = [abs(v) for v in section.integers(int(section.integers(1, size)[0])).tolist()]
            if dimension > 0:
                section.integers(int(section.integers(1, size)[0]))
    return groups
