"""Abaqus's input files (.inp): solid elements, or where there are none surfaces, with the sets of nodes and elements.

Parts, instances, files that are included, local and curved systems of coordinates and generated nodes and elements are
applied. A keyword that changes the mesh otherwise is refused. Elements without a volume are left out.

Source: Abaqus Analysis User's Guide, "Defining an assembly", and the files beside this one. Solids have their nodes in
the order of VTK.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.abaqus.blocks import Block, Line, blocks
from supple.mesh.io.abaqus.parts import PART_KEYWORDS, Budget, Part, Sets, placement
from supple.mesh.io.cells import KINDS, CellSoup, FormatError, MeshFile
from supple.mesh.io.text import shortened

# They change the mesh, and are not read.
_REFUSED = ("NMAP", "IMPERFECTION", "IMPORT", "SYMMETRIC MODEL GENERATION", "SUBMODEL MESH", "MAP SOLUTION MESH")


class Numbers:
    """Places, counted from 0, of things that a deck numbers in any order."""

    def __init__(self, tags: NDArray[np.int64], kind: str) -> None:
        self._order = np.argsort(tags, kind="stable")
        self._sorted, self._kind = tags[self._order], kind
        twice = np.flatnonzero(self._sorted[1:] == self._sorted[:-1])
        if len(twice):
            raise FormatError(f"{kind} {self._sorted[twice[0]]} is given twice")

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


class _Placed(NamedTuple):
    """A part at a place: the name of the instance, and the part and what the instance itself defines."""

    name: str
    parts: tuple[Part, ...]
    linear: NDArray[np.float64]
    shift: NDArray[np.float64]


class _Deck:
    """The keywords of a deck, one after the other."""

    def __init__(self) -> None:
        self.budget = Budget()
        self.root = Part("", self.budget)
        self.parts: dict[str, Part] = {}
        self.placed: list[_Placed] = []
        self._scope = self.root
        # Sets of the assembly: name, then for each member the instance and its number or set.
        self.shared: dict[str, dict[str, list[tuple[str, Line, bool]]]] = {"NSET": {}, "ELSET": {}}

    def apply(self, block: Block) -> None:
        keyword, options = block.keyword, block.options
        if keyword in _REFUSED:
            raise FormatError(
                f"*{keyword} changes the mesh, and is not read; write the deck with all its nodes and elements",
                block.place,
            )
        if keyword == "PART":
            name = block.named("NAME")
            self._scope = self.parts[name.upper()] = Part(name, self.budget)
        elif keyword == "INSTANCE":
            self._instance(block)
        elif keyword in ("END PART", "END INSTANCE", "ASSEMBLY", "END ASSEMBLY"):
            self._scope = self.root
        elif keyword in ("NSET", "ELSET") and self._scope is self.root and self._of_instances(block):
            words = self.shared[keyword].setdefault(block.named(keyword), [])
            words += [(options.get("INSTANCE", ""), line, "GENERATE" in options) for line in block.lines]
        elif keyword in PART_KEYWORDS:
            self._scope.apply(block)

    def _instance(self, block: Block) -> None:
        block.refuse("INSTANCE", "LIBRARY")
        name, part = block.named("NAME"), block.named("PART")
        if part.upper() not in self.parts:
            raise FormatError(f"the part '{shortened([part])}' does not exist", block.place)
        if any(name.upper() == other.name.upper() for other in self.placed):
            raise FormatError(f"the instance '{shortened([name])}' is given twice", block.place)
        self._scope = Part(name, self.budget)
        used = self.parts[part.upper()]
        if any(used is one.parts[0] for one in self.placed):  # the first one is the deck itself
            self.budget.take(used.size, block.place)
        linear, shift = placement(block)
        self.placed.append(_Placed(name, (used, self._scope), linear, shift))

    def _of_instances(self, block: Block) -> bool:
        """Whether a set of the assembly has members of instances."""
        return bool(self.placed) and (
            "INSTANCE" in block.options or any("." in word for line in block.lines for word in line.words)
        )

    def all_placed(self) -> list[_Placed]:
        """The instances; of a deck that has parts without any, the parts, and of one without parts the whole."""
        alone = [] if self.placed else [(part.name, part) for part in self.parts.values()]
        alone.append(("", self.root))
        return [*self.placed, *(_Placed(name, (part,), np.eye(3), np.zeros(3)) for name, part in alone)]


def read(data: bytes, path: Path) -> MeshFile:
    """The cells and sets of an input file. Materials and steps are ignored.

    path : of the file; it may include others of its folder, and of folders below
    """
    deck = _Deck()
    for block in blocks(data, path, PART_KEYWORDS | {"INSTANCE"}):
        deck.apply(block)
    placed = deck.all_placed()
    points: list[NDArray[np.float64]] = []
    cells: list[tuple[int, NDArray[np.int64], NDArray[np.int64]]] = []
    node_sets: dict[str, list[NDArray[np.int64]]] = {}
    cell_sets: dict[str, list[NDArray[np.int64]]] = {}
    several = len(deck.placed) > 1 or (not deck.placed and len(deck.parts) > 1)
    nodes_before = cells_before = 0
    instances: dict[str, _Instance] = {}
    for one in placed:
        tags, own_points = _nodes_of(one.parts)
        nodes = Numbers(tags, "node")
        element_tags = []
        for part in one.parts:
            for (number, width), (own, rows) in part.elements.items():
                element_tags.append(own)
                cells.append((number, np.full(len(rows), width), nodes.places(rows).ravel() + nodes_before))
        elements = Numbers(np.concatenate([np.zeros(0, np.int64), *element_tags]), "element")
        points.append(own_points @ one.linear.T + one.shift)
        for part in one.parts:
            for name, members in _named(part.node_sets, one.name if several else ""):
                node_sets.setdefault(name, []).append(nodes.places(members) + nodes_before)
            for name, members in _named(part.element_sets, one.name if several else ""):
                cell_sets.setdefault(name, []).append(elements.known(members) + cells_before)
        merged = (Sets("node"), Sets("element"))
        for part in one.parts:
            for chosen, own_sets in zip(merged, (part.node_sets, part.element_sets), strict=True):
                for key, members in own_sets.members.items():
                    chosen.of(key).extend(members)
        instances[one.name.upper()] = _Instance(nodes, elements, (nodes_before, cells_before), merged)
        nodes_before, cells_before = nodes_before + len(tags), cells_before + sum(map(len, element_tags))
    if nodes_before == 0:
        raise FormatError("it has no nodes")
    for name, members in deck.shared["NSET"].items():
        node_sets.setdefault(name, []).extend(_members(instances, members, 0))
    for name, members in deck.shared["ELSET"].items():
        cell_sets.setdefault(name, []).extend(_members(instances, members, 1))
    soup = CellSoup.of_blocks(np.concatenate(points), cells)
    return MeshFile(soup, _joined(node_sets), _joined(cell_sets), _notes(deck, soup))


def _joined(sets: dict[str, list[NDArray[np.int64]]]) -> dict[str, NDArray[np.int64]]:
    """Of sets with members, the rows."""
    joined = {name: np.unique(np.concatenate(own)) for name, own in sets.items() if own}
    return {name: rows for name, rows in joined.items() if len(rows)}


def _nodes_of(parts: tuple[Part, ...]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    nodes = [part.nodes for part in parts]
    return np.concatenate([tags for tags, _ in nodes]), np.concatenate([points for _, points in nodes])


def _named(sets: Sets, instance: str) -> list[tuple[str, NDArray[np.int64]]]:
    """Sets of a part that have members, with their names: `instance.set` where there are several instances."""
    return [
        (f"{instance}.{sets.spelling[key]}" if instance else sets.spelling[key], np.array(own, dtype=np.int64))
        for key, own in sets.members.items()
        if len(own)
    ]


class _Instance(NamedTuple):
    """The numbers and sets of a placed part, and how many nodes and cells lie before its own."""

    nodes: Numbers
    elements: Numbers
    before: tuple[int, int]
    sets: tuple[Sets, Sets]


def _members(
    instances: dict[str, _Instance], lines: list[tuple[str, Line, bool]], kind: int
) -> list[NDArray[np.int64]]:
    """Rows of nodes (kind 0) or cells (1) that lines of a set of the assembly name: numbers and sets of instances."""
    rows = []
    for instance, line, generate in lines:
        pairs = [(instance, line)]
        if not instance:  # instance.number or instance.set
            split = (word.rpartition(".") for word in line.words if word)
            pairs = [(name, line._replace(words=[word])) for name, _, word in split]
        for name, own in pairs:
            if name.upper() not in instances:
                raise FormatError(f"the instance '{shortened([name])}' does not exist", line.place)
            one = instances[name.upper()]
            one.sets[kind].add(" ", [own], generate=generate)
            found = np.array(one.sets[kind].members.pop(" "), dtype=np.int64)
            rows.append((one.elements.known(found) if kind else one.nodes.places(found)) + one.before[kind])
    return rows


def _notes(deck: _Deck, soup: CellSoup) -> list[str]:
    """What was left out or decided."""
    parts = [deck.root, *deck.parts.values(), *(part for one in deck.placed for part in one.parts[1:])]
    notes = []
    left_out = dict.fromkeys(kind for part in parts for kind in part.left_out)
    if left_out and any(KINDS[number].dimension == 3 for number in np.unique(soup.types)):
        notes.append(f"elements without a volume were left out: {', '.join(list(left_out)[:8])}")
    elif left_out and len(soup.types) == 0:
        raise FormatError(f"its elements have neither a volume nor a surface: {', '.join(list(left_out)[:8])}")
    repeated = sum(part.repeated for part in parts)
    if repeated:
        notes.append(f"{repeated:,} nodes are given more than once; the last place counts, as in Abaqus")
    if any(part.spherical for part in parts):
        notes.append("SYSTEM=S: the second angle is taken as that above the plane of x and y")
    if deck.parts and not deck.placed:
        notes.append("its parts have no *INSTANCE; each was placed once, as it is")
    return notes
