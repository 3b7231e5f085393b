"""Node and element sets of Abaqus's input files (.inp).

Source: Abaqus Analysis User's Guide, "Input syntax rules", "Node definition", "Element definition". The keywords that
are read are *NODE, *ELEMENT, *NSET and *ELSET, of one part without instances.
"""

from __future__ import annotations

import numpy as np

from supple.mesh.io.cells import FormatError
from supple.mesh.io.models.abaqus_blocks import Block, Numbers, blocks, elements_of
from supple.mesh.io.models.named_sets import NamedSets
from supple.mesh.io.text import decoded, integer, shortened

_MOST_MEMBERS = 100_000_000


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

    for block in blocks(decoded(data)):
        if block.keyword == "NODE":
            tags = [integer(words[0], line, "a node's number") for line, words in block.lines]
            nodes += tags
            if "NSET" in block.options:
                members("NSET", block.options["NSET"]).extend(tags)
        elif block.keyword == "ELEMENT":
            numbers, rows = elements_of(block)
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
    order = Numbers(nodes, "node")
    tets = order.places(np.array(rows, dtype=np.int64))
    places = Numbers(elements, "element")
    node_sets = {name: np.unique(order.places(np.array(tags))) for name, tags in listed["NSET"].items() if tags}
    tet_sets = {}
    for name, tags in listed["ELSET"].items():
        solid = places.known(np.array(tags, dtype=np.int64))
        if len(solid):
            tet_sets[name] = np.unique(solid)
    return NamedSets(len(nodes), tets, node_sets, tet_sets)


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
