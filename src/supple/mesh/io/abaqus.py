"""Abaqus's input files (.inp): the nodes, and the elements C3D4 and C3D10 with their variants.

Source: Abaqus Analysis User's Guide, "Input syntax rules", and "Three-dimensional solid element library" for the order
of nodes, which for C3D10 is that of VTK's quadratic tetrahedron.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import QUADRATIC_TETRA, TETRA, Block, CellSoup, FormatError
from supple.mesh.io.text import decoded, integer, numbers, shortened

_TETS = {"C3D4": (4, TETRA), "C3D10": (10, QUADRATIC_TETRA)}
# Elements that are no solids: trusses, beams, shells, membranes and rigid surfaces, which meshers write for boundaries.
_NOT_SOLID = ("T3D", "T2D", "B2", "B3", "S3", "S4", "S6", "S8", "S9", "STRI", "M3D", "R3D", "CPS", "CPE", "MASS")


def read(data: bytes) -> CellSoup:
    """Nodes and tets of an input file of one part; sets, materials and steps are ignored."""
    tags: list[int] = []
    points: list[list[float]] = []
    elements: dict[str, list[list[int]]] = {name: [] for name in _TETS}
    first_line: dict[str, int] = {}
    for keyword, options, lines in _blocks(decoded(data)):
        if keyword == "NODE":
            for line, words in lines:
                tags.append(integer(words[0], line, "a node's number"))
                # Coordinates that are left out are zero.
                points.append([*numbers(words[1:4], len(words[1:4]), line, "a node"), 0.0, 0.0, 0.0][:3])
        elif keyword == "ELEMENT":
            kind = options.get("TYPE", "").upper()
            name = next((name for name in ("C3D10", "C3D4") if kind.startswith(name)), "")
            if not name:
                if kind.startswith(_NOT_SOLID):
                    continue
                raise FormatError(f"it has elements of type '{shortened([kind])}'; only C3D4 and C3D10 can be used")
            width = _TETS[name][0]
            values: list[int] = []
            for line, words in lines:
                first_line.setdefault(name, line)
                values += [integer(word, line, "an element's node") for word in words]
            if len(values) % (width + 1):
                raise FormatError(f"its {name} elements do not have a number and {width} nodes each", first_line[name])
            elements[name] += [values[k + 1 : k + 1 + width] for k in range(0, len(values), width + 1)]
    if not tags:
        raise FormatError("it has no *NODE block")
    order = np.argsort(np.array(tags, dtype=np.int64), kind="stable")
    ordered = np.array(tags, dtype=np.int64)[order]
    twice = np.flatnonzero(ordered[1:] == ordered[:-1])
    if len(twice):
        raise FormatError(f"node {ordered[twice[0]]} is given twice; save one part without instances")
    blocks: list[Block] = []
    for name, rows in elements.items():
        if not rows:
            continue
        nodes = np.array(rows, dtype=np.int64)
        place = np.minimum(np.searchsorted(ordered, nodes), len(ordered) - 1)
        unknown = ordered[place] != nodes
        if unknown.any():
            raise FormatError(f"an element names node {nodes[unknown][0]}, which does not exist", first_line[name])
        width, cell_type = _TETS[name]
        blocks.append((cell_type, np.full(len(rows), width), order[place].ravel()))
    return CellSoup.of_blocks(np.array(points), blocks)


def _blocks(text: str) -> Iterator[tuple[str, dict[str, str], list[tuple[int, list[str]]]]]:
    """Each keyword in capitals, its options, and the numbered data lines that follow it."""
    keyword, options, lines = "", {}, []
    for number, line in enumerate(text.split("\n"), start=1):
        stripped = line.strip()
        if not stripped or stripped.startswith("**"):
            continue
        words = [word.strip() for word in stripped.split(",")]
        if stripped.startswith("*"):
            yield keyword, options, lines
            keyword, lines = words[0][1:].strip().upper(), []
            pairs = (word.partition("=") for word in words[1:])
            options = {name.strip().upper(): value.strip() for name, _, value in pairs}
        elif keyword in ("NODE", "ELEMENT") and any(words):
            lines.append((number, [word for word in words if word]))
    yield keyword, options, lines


def written(vertices: NDArray[np.float64], tets: NDArray[np.int32]) -> bytes:
    """One part with its nodes and elements, and the set ALL of the latter."""
    name = "C3D4" if tets.shape[1] == 4 else "C3D10"
    out = ["*HEADING", "written by supple", "*NODE"]
    out += [f"{k}, {x!r}, {y!r}, {z!r}" for k, (x, y, z) in enumerate(vertices.tolist(), start=1)]
    out.append(f"*ELEMENT, TYPE={name}, ELSET=ALL")
    out += [f"{k}, " + ", ".join(str(i + 1) for i in row) for k, row in enumerate(tets.tolist(), start=1)]
    return ("\n".join(out) + "\n").encode()
