"""Abaqus's input files (.inp): the nodes, the elements C3D4 and C3D10 with their variants, and the sets of both.

Source: Abaqus Analysis User's Guide, "Input syntax rules", "Node definition", "Element definition", and
"Three-dimensional solid element library" for the order of nodes: for C3D10 it is that of VTK's quadratic tetrahedra.
The keywords that are read are *NODE, *ELEMENT, *NSET and *ELSET, of one part without instances.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import QUADRATIC_TETRA, TETRA, CellSoup, FormatError, MeshFile
from supple.mesh.io.text import decoded, integer, numbers, shortened

# Solid tets, with their nodes and VTK's number. The longer name first: variants such as C3D10M begin with it.
_SOLID = {"C3D10": (10, QUADRATIC_TETRA), "C3D4": (4, TETRA)}
# Not solids: trusses, beams, shells, membranes and rigid surfaces, which meshers write for boundaries.
_NOT_SOLID = ("T3D", "T2D", "B2", "B3", "S3", "S4", "S6", "S8", "S9", "STRI", "M3D", "R3D", "CPS", "CPE", "MASS")
_KEYWORDS = ("NODE", "ELEMENT", "NSET", "ELSET")
_MOST_MEMBERS = 100_000_000


class Block(NamedTuple):
    """A keyword in capitals, its options, and the numbered data lines that follow it."""

    keyword: str
    options: dict[str, str]
    lines: list[tuple[int, list[str]]]
    line: int


class _Sets:
    """Sets of one kind, by name in capitals, with the spelling of the first definition."""

    def __init__(self) -> None:
        self.members: dict[str, list[int]] = {}
        self.spelling: dict[str, str] = {}

    def of(self, name: str) -> list[int]:
        self.spelling.setdefault(name.upper(), name)
        return self.members.setdefault(name.upper(), [])

    def named(self) -> Iterator[tuple[str, list[int]]]:
        return ((self.spelling[key], own) for key, own in self.members.items())

    def add(self, block: Block) -> None:
        """Add what the lines of a set list: numbers, names of other sets, or with GENERATE first, last and step."""
        name = block.options.get(block.keyword)
        if not name:
            raise FormatError(f"*{block.keyword} has no name; give {block.keyword}=...", block.line)
        members = self.of(name)
        for line, words in block.lines:
            if "GENERATE" in block.options:
                values = [integer(word, line, "a member") for word in words]
                first, last, step = [*values, 1][:3] if len(values) in (2, 3) else (0, 0, 0)
                if step < 1 or last < first:
                    raise FormatError("GENERATE needs first, last and step", line)
                if (last - first) // step >= _MOST_MEMBERS - len(members):
                    raise FormatError(f"a set has more than {_MOST_MEMBERS} members", line)
                members.extend(range(first, last + 1, step))
                continue
            for word in words:
                if word.lstrip("+-").isdigit():
                    members.append(integer(word, line, "a member"))
                elif word.upper() in self.members:
                    members.extend(self.members[word.upper()])
                else:
                    raise FormatError(f"names the set '{shortened([word])}', which is not defined before", line)
                if len(members) > _MOST_MEMBERS:
                    raise FormatError(f"a set has more than {_MOST_MEMBERS} members", line)


def read(data: bytes) -> MeshFile:
    """Nodes, tets and sets of an input file of one part; materials and steps are ignored."""
    tags: list[int] = []
    points: list[list[float]] = []
    elements: dict[str, list[int]] = {}
    corners: dict[str, list[list[int]]] = {}
    node_sets, element_sets = _Sets(), _Sets()
    for block in blocks(decoded(data)):
        if block.keyword == "NODE":
            for line, words in block.lines:
                tags.append(integer(words[0], line, "a node's number"))
                # Coordinates that are left out are zero.
                points.append([*numbers(words[1:4], len(words[1:4]), line, "a node"), 0.0, 0.0, 0.0][:3])
            if "NSET" in block.options:
                node_sets.of(block.options["NSET"]).extend(tags[len(tags) - len(block.lines) :])
        elif block.keyword == "ELEMENT":
            kind = block.options.get("TYPE", "").upper()
            name = next((name for name in _SOLID if kind.startswith(name)), None)
            if name is None and block.lines and not kind.startswith(_NOT_SOLID):
                raise FormatError(f"it has elements of type '{shortened([kind])}'; only C3D4 and C3D10 can be used")
            if name is not None:
                own, rows = _elements_of(block, name)
                elements.setdefault(name, []).extend(own)
                corners.setdefault(name, []).extend(rows)
                if "ELSET" in block.options:
                    element_sets.of(block.options["ELSET"]).extend(own)
        elif block.keyword in ("NSET", "ELSET"):
            (node_sets if block.keyword == "NSET" else element_sets).add(block)
    if not tags:
        raise FormatError("it has no *NODE block")
    nodes = Numbers(tags, "node")
    tets = Numbers([tag for own in elements.values() for tag in own], "element")
    cells = []
    for name, rows in corners.items():
        width, cell_type = _SOLID[name]
        places = nodes.places(np.array(rows, dtype=np.int64).reshape(-1, width))
        cells.append((cell_type, np.full(len(rows), width), places.ravel()))
    of_nodes = {name: np.unique(nodes.places(np.array(own))) for name, own in node_sets.named() if own}
    of_tets = {name: np.unique(tets.known(np.array(own, dtype=np.int64))) for name, own in element_sets.named()}
    soup = CellSoup.of_blocks(np.array(points), cells)
    return MeshFile(soup, of_nodes, {name: rows for name, rows in of_tets.items() if len(rows)})


def blocks(text: str) -> Iterator[Block]:
    """The keywords of a file, with the data of those of `_KEYWORDS`."""
    block = Block("", {}, [], 0)
    joined = ""
    for number, line in enumerate(text.split("\n"), start=1):
        stripped = joined + line.strip()
        joined = ""
        if not stripped or stripped.startswith("**"):
            continue
        if stripped.startswith("*") and stripped.endswith(","):  # a keyword line goes on in the next one
            joined = stripped
            continue
        words = [word.strip() for word in stripped.split(",")]
        if stripped.startswith("*"):
            yield block
            pairs = (word.partition("=") for word in words[1:])
            options = {name.strip().upper(): value.strip().strip('"') for name, _, value in pairs}
            block = Block(words[0][1:].strip().upper(), options, [], number)
        elif block.keyword in _KEYWORDS:
            data = [word for word in words if word]
            if data:
                block.lines.append((number, data))
    yield block


def _elements_of(block: Block, name: str) -> tuple[list[int], list[list[int]]]:
    """Numbers of the elements, and the nodes of each. An element may go on in the next line."""
    width = _SOLID[name][0] + 1
    values = [integer(word, line, "an element's node") for line, words in block.lines for word in words]
    if len(values) % width:
        raise FormatError(f"its {name} elements do not have a number and {width - 1} nodes each", block.line)
    return values[::width], [values[k + 1 : k + width] for k in range(0, len(values), width)]


class Numbers:
    """Places, counted from 0, of things that a file numbers in any order."""

    def __init__(self, tags: list[int], kind: str) -> None:
        given = np.array(tags, dtype=np.int64)
        self._order = np.argsort(given, kind="stable")
        self._sorted, self._kind = given[self._order], kind
        twice = np.flatnonzero(self._sorted[1:] == self._sorted[:-1])
        if len(twice):
            raise FormatError(f"{kind} {self._sorted[twice[0]]} is given twice; save one part without instances")

    def places(self, tags: NDArray[np.int64]) -> NDArray[np.int64]:
        """Of numbers of any shape, which must all exist."""
        found, known = self._find(tags)
        if not known.all():
            raise FormatError(f"{self._kind} {tags[~known].flat[0]} is used, and does not exist")
        return self._order[found]

    def known(self, tags: NDArray[np.int64]) -> NDArray[np.int64]:
        """Of those numbers that exist."""
        found, known = self._find(tags)
        return self._order[found[known]]

    def _find(self, tags: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        if len(self._sorted) == 0:
            return np.zeros(tags.shape, dtype=np.int64), np.zeros(tags.shape, dtype=bool)
        found = np.minimum(np.searchsorted(self._sorted, tags), len(self._sorted) - 1)
        return found, self._sorted[found] == tags


def written(vertices: NDArray[np.float64], tets: NDArray[np.int32]) -> bytes:
    """One part with its nodes and elements, and the set ALL of the latter."""
    name = "C3D4" if tets.shape[1] == 4 else "C3D10"
    out = ["*HEADING", "written by supple", "*NODE"]
    out += [f"{k}, {x!r}, {y!r}, {z!r}" for k, (x, y, z) in enumerate(vertices.tolist(), start=1)]
    out.append(f"*ELEMENT, TYPE={name}, ELSET=ALL")
    out += [f"{k}, " + ", ".join(str(i + 1) for i in row) for k, row in enumerate(tets.tolist(), start=1)]
    return ("\n".join(out) + "\n").encode()
