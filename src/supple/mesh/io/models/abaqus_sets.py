"""Node and element sets of Abaqus's input files (.inp).

Source: Abaqus Analysis User's Guide, "Input syntax rules", "Node definition", "Element definition". The keywords that
are read are *NODE, *ELEMENT, *NSET and *ELSET, of one part without instances.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import FormatError
from supple.mesh.io.models.named_sets import NamedSets
from supple.mesh.io.text import decoded, integer, shortened

_NODES_OF = {"C3D10": 10, "C3D4": 4}  # the longer name first: variants such as C3D10M begin with it
_MOST_MEMBERS = 100_000_000


class Block(NamedTuple):
    """A keyword in capitals, its options, and the numbered data lines that follow it."""

    keyword: str
    options: dict[str, str]
    lines: list[tuple[int, list[str]]]
    line: int


def read(data: bytes) -> NamedSets:
    """The sets of an input file."""
    nodes: list[int] = []
    elements: list[int] = []
    corners: dict[int, list[list[int]]] = {}
    listed: dict[str, dict[str, list[int]]] = {"NSET": {}, "ELSET": {}}
    named: dict[str, dict[str, str]] = {"NSET": {}, "ELSET": {}}  # the spelling of the first definition

    def members(kind: str, name: str) -> list[int]:
        spelling = named[kind].setdefault(name.upper(), name)
        return listed[kind].setdefault(spelling, [])

    for block in _blocks(decoded(data)):
        if block.keyword == "NODE":
            tags = [integer(words[0], line, "a node's number") for line, words in block.lines]
            nodes += tags
            if "NSET" in block.options:
                members("NSET", block.options["NSET"]).extend(tags)
        elif block.keyword == "ELEMENT":
            numbers, rows = _elements(block)
            if rows is not None:
                elements += numbers
                corners.setdefault(len(rows[0]) if rows else 4, []).extend(rows)
            if "ELSET" in block.options:
                members("ELSET", block.options["ELSET"]).extend(numbers)
        elif block.keyword in listed:
            name = block.options.get(block.keyword)
            if not name:
                raise FormatError(f"*{block.keyword} has no name; give {block.keyword}=...", block.line)
            _add(members(block.keyword, name), block, listed[block.keyword], named[block.keyword])
    if not corners:
        raise FormatError("it has no tetrahedra (C3D4 or C3D10)")
    if len(corners) > 1:
        raise FormatError("it has tetrahedra of 4 and of 10 nodes; save it with one kind")
    (rows,) = corners.values()
    order = _Numbers(nodes, "node")
    tets = order.places(np.array(rows, dtype=np.int64))
    places = _Numbers(elements, "element")
    node_sets = {name: np.unique(order.places(np.array(tags))) for name, tags in listed["NSET"].items() if tags}
    tet_sets = {}
    for name, tags in listed["ELSET"].items():
        solid = places.known(np.array(tags, dtype=np.int64))
        if len(solid):
            tet_sets[name] = np.unique(solid)
    return NamedSets(len(nodes), tets, node_sets, tet_sets)


def _elements(block: Block) -> tuple[list[int], list[list[int]] | None]:
    """Numbers of the elements, and the nodes of each; None for elements that are not solid tets."""
    kind = block.options.get("TYPE", "").upper()
    name = next((name for name in _NODES_OF if kind.startswith(name)), None)
    if name is None:
        return [], None
    width = _NODES_OF[name] + 1
    values = [integer(word, line, "an element's node") for line, words in block.lines for word in words]
    if len(values) % width:
        raise FormatError(f"its {name} elements do not have a number and {width - 1} nodes each", block.line)
    return values[::width], [values[k + 1 : k + width] for k in range(0, len(values), width)]


def _add(members: list[int], block: Block, known: dict[str, list[int]], named: dict[str, str]) -> None:
    """Add what the lines of a set list: numbers, names of other sets, or with GENERATE first, last and step."""
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
            elif word.upper() in named:
                members.extend(known.get(named[word.upper()], []))
            else:
                raise FormatError(f"names the set '{shortened([word])}', which is not defined before", line)
            if len(members) > _MOST_MEMBERS:
                raise FormatError(f"a set has more than {_MOST_MEMBERS} members", line)


class _Numbers:
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


def _blocks(text: str) -> Iterator[Block]:
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
        elif block.keyword in ("NODE", "ELEMENT", "NSET", "ELSET"):
            data = [word for word in words if word]
            if data:
                block.lines.append((number, data))
    yield block
