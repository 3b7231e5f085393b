"""Abaqus's input files (.inp): the nodes, and the elements C3D4 and C3D10 with their variants.

Source: Abaqus Analysis User's Guide, "Input syntax rules", and "Three-dimensional solid element library" for the order
of nodes, which for C3D10 is that of VTK's quadratic tetrahedron.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import QUADRATIC_TETRA, TETRA, CellSoup, FormatError
from supple.mesh.io.cells import Block as CellBlock
from supple.mesh.io.models.abaqus_blocks import Numbers, blocks, elements_of
from supple.mesh.io.text import decoded, integer, numbers, shortened

# Elements that are no solids: trusses, beams, shells, membranes and rigid surfaces, which meshers write for boundaries.
_NOT_SOLID = ("T3D", "T2D", "B2", "B3", "S3", "S4", "S6", "S8", "S9", "STRI", "M3D", "R3D", "CPS", "CPE", "MASS")


def read(data: bytes) -> CellSoup:
    """Nodes and tets of an input file of one part; sets, materials and steps are ignored."""
    tags: list[int] = []
    points: list[list[float]] = []
    elements: dict[int, list[list[int]]] = {}
    for block in blocks(decoded(data)):
        if block.keyword == "NODE":
            for line, words in block.lines:
                tags.append(integer(words[0], line, "a node's number"))
                # Coordinates that are left out are zero.
                points.append([*numbers(words[1:4], len(words[1:4]), line, "a node"), 0.0, 0.0, 0.0][:3])
        elif block.keyword == "ELEMENT":
            _, rows = elements_of(block)
            kind = block.options.get("TYPE", "").upper()
            if rows:
                elements.setdefault(len(rows[0]), []).extend(rows)
            elif rows is None and not kind.startswith(_NOT_SOLID):
                raise FormatError(f"it has elements of type '{shortened([kind])}'; only C3D4 and C3D10 can be used")
    if not tags:
        raise FormatError("it has no *NODE block")
    places = Numbers(tags, "node")
    cells: list[CellBlock] = []
    for width, rows in elements.items():
        nodes = places.places(np.array(rows, dtype=np.int64))
        cells.append((TETRA if width == 4 else QUADRATIC_TETRA, np.full(len(rows), width), nodes.ravel()))
    return CellSoup.of_blocks(np.array(points), cells)


def written(vertices: NDArray[np.float64], tets: NDArray[np.int32]) -> bytes:
    """One part with its nodes and elements, and the set ALL of the latter."""
    name = "C3D4" if tets.shape[1] == 4 else "C3D10"
    out = ["*HEADING", "written by supple", "*NODE"]
    out += [f"{k}, {x!r}, {y!r}, {z!r}" for k, (x, y, z) in enumerate(vertices.tolist(), start=1)]
    out.append(f"*ELEMENT, TYPE={name}, ELSET=ALL")
    out += [f"{k}, " + ", ".join(str(i + 1) for i in row) for k, row in enumerate(tets.tolist(), start=1)]
    return ("\n".join(out) + "\n").encode()
