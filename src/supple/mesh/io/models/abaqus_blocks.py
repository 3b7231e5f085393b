"""The syntax of Abaqus's input files (.inp): keyword blocks, numbered nodes and elements.

Source: Abaqus Analysis User's Guide, "Input syntax rules", "Node definition", "Element definition".
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import FormatError
from supple.mesh.io.text import integer

# Solid tets and their nodes. The longer name first: variants such as C3D10M begin with it.
NODES_OF = {"C3D10": 10, "C3D4": 4}
KEYWORDS = ("NODE", "ELEMENT", "NSET", "ELSET")


class Block(NamedTuple):
    """A keyword in capitals, its options, and the numbered data lines that follow it."""

    keyword: str
    options: dict[str, str]
    lines: list[tuple[int, list[str]]]
    line: int


def blocks(text: str) -> Iterator[Block]:
    """The keywords of a file, with the data of those of `KEYWORDS`."""
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
        elif block.keyword in KEYWORDS:
            data = [word for word in words if word]
            if data:
                block.lines.append((number, data))
    yield block


def elements_of(block: Block) -> tuple[list[int], list[list[int]] | None]:
    """Numbers of the elements, and the nodes of each; none for elements that are not solid tets.

    Raises
    ------
    FormatError : where one is not complete.
    """
    kind = block.options.get("TYPE", "").upper()
    name = next((name for name in NODES_OF if kind.startswith(name)), None)
    if name is None:
        return [], None
    width = NODES_OF[name] + 1
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
