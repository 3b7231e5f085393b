"""Gmsh's .msh by meshio: versions 1, 2, 4.0 and 4.1, text and binary, with its physical groups; and Medit's .mesh."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import KINDS, CellSoup, FormatError, MeshFile
from supple.mesh.io.in_child import read_in_child
from supple.mesh.io.text import decoded, integer, without_mark

# VTK's numbers of the types of meshio, each a shape and a number of nodes. Those of higher order keep their corners.
_QUADRATIC = {
    "line3": 21, "triangle6": 22, "quad8": 23, "tetra10": 24, "hexahedron20": 25, "wedge15": 26, "pyramid13": 27,
}  # fmt: skip
_SHAPES = {"vertex": 1, "line": 3, "triangle": 5, "quad": 9, "tetra": 10, "hexahedron": 12, "wedge": 13, "pyramid": 14}


def read_msh(data: bytes) -> MeshFile:
    """Cells and physical groups of a .msh file."""
    data = without_mark(data).lstrip()
    if data.startswith(b"$NOD"):
        data = _version_2(decoded(data))
    if not data.startswith((b"$MeshFormat", b"$Comments")):
        raise FormatError("it does not begin with '$MeshFormat'; is it a Gmsh file?", 1)
    for section in ("Nodes", "Elements"):  # meshio takes what is there of one that is cut off
        if f"$End{section}".encode() not in data:
            raise FormatError(f"it has no $End{section}: it is truncated, or has no mesh")
    return read_in_child(data, "meshio", ".msh")


def _version_2(text: str) -> bytes:
    """A file of version 1 as one of 2.2. In version 1 an element is number, type, group, entity, count of nodes, nodes.

    Source: "MSH file format version 1" of Gmsh's documentation.
    """
    names = {"$NOD": "$Nodes", "$ENDNOD": "$EndNodes", "$ELM": "$Elements", "$ENDELM": "$EndElements"}
    lines, in_elements = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat"], False
    for number, line in enumerate(text.split("\n"), start=1):
        words = line.split()
        if words and words[0].startswith("$"):
            in_elements = words[0] == "$ELM"
            words[0] = names.get(words[0], words[0])
        elif in_elements and len(words) > 1:
            count = integer(words[4] if len(words) > 4 else "", number, "number of an element's nodes")
            if len(words) != 5 + count:
                raise FormatError(f"an element names {len(words) - 5} nodes, not {count}", number)
            words = [*words[:2], "2", *words[2:4], *words[5:]]
        lines.append(" ".join(words))
    return "\n".join([line for line in lines if line] + [""]).encode()


def read_medit(data: bytes) -> MeshFile:
    """Cells of a text file of Medit (.mesh), as Mmg and TetGen write it; the references of solids are sets, `ref 1`"""
    data = without_mark(data).lstrip()
    if not data.startswith(b"MeshVersionFormatted"):
        raise FormatError("it does not begin with 'MeshVersionFormatted'; of .mesh files, Medit's text can be read", 1)
    return read_in_child(data, "meshio", ".mesh")


def read_file(path: Path) -> MeshFile:
    """The same, in this process."""
    import meshio

    mesh = meshio.gmsh.read(path) if path.suffix == ".msh" else meshio.medit.read(path)
    points = np.asarray(mesh.points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise FormatError(f"its points have {points.shape[-1]} coordinates, not 3")
    blocks = []
    for block in mesh.cells:
        rows = np.asarray(block.data)
        number = _QUADRATIC.get(block.type)
        if number is None:  # of higher order, or without corners
            number = _SHAPES.get(block.type.rstrip("0123456789"))
            if number is None:
                raise FormatError(f"it has {block.type} cells, which cannot be read: convert or remesh it")
            rows = rows[:, : KINDS[number].corners]
        blocks.append((number, np.full(*rows.shape), rows.ravel().astype(np.int64)))
    starts = np.cumsum([0, *(len(block.data) for block in mesh.cells)])
    dimensions = [KINDS[number].dimension for number, _, _ in blocks]
    node_sets: dict[str, NDArray[np.int64]] = {}
    cell_sets: dict[str, NDArray[np.int64]] = {}
    for name, (number, dimension) in _groups(mesh).items():
        rows = _rows_of(mesh, name, number, [size == dimension for size in dimensions])
        members = [np.asarray(block.data)[own].ravel() for block, own in zip(mesh.cells, rows, strict=True)]
        nodes = np.unique(np.concatenate(members)).astype(np.int64)
        if len(nodes):
            node_sets[name] = nodes
            if dimension == 3:
                cell_sets[name] = np.concatenate(
                    [start + own for start, own in zip(starts, rows, strict=False)]
                ).astype(np.int64)
    return MeshFile(CellSoup.of_blocks(points, blocks), node_sets, cell_sets)


def _groups(mesh) -> dict[str, tuple[int, int]]:
    """Number and dimension of each named group; of Medit's solids, of each reference where there are several."""
    if "medit:ref" not in mesh.cell_data:
        return {name: (int(number), int(dimension)) for name, (number, dimension) in mesh.field_data.items()}
    own = [refs for block, refs in zip(mesh.cells, mesh.cell_data["medit:ref"], strict=True) if block.dim == 3]
    refs = np.unique(np.concatenate(own)) if own else []
    return {f"ref {ref}": (int(ref), 3) for ref in refs} if 1 < len(refs) <= 1000 else {}


def _rows_of(mesh, name: str, number: int, chosen: list[bool]) -> list[NDArray[np.integer]]:
    """Which cells of each block are of a group. Version 4.1 has groups of entities, others a number for each cell."""
    if name in mesh.cell_sets:
        return [np.zeros(0, dtype=np.int64) if rows is None else np.asarray(rows) for rows in mesh.cell_sets[name]]
    key = "medit:ref" if "medit:ref" in mesh.cell_data else "gmsh:physical"
    groups = mesh.cell_data.get(key, [[]] * len(mesh.cells))
    pairs = zip(chosen, groups, strict=True)
    return [np.flatnonzero((np.asarray(own) == number) & right) for right, own in pairs]


def write_msh(path: Path, vertices: NDArray[np.float64], tets: NDArray[np.int32]) -> None:
    """Version 4.1, binary."""
    import meshio

    with contextlib.redirect_stderr(io.StringIO()):
        kind = "tetra" if tets.shape[1] == 4 else "tetra10"
        mesh = meshio.Mesh(np.array(vertices), [(kind, np.array(tets))])
        meshio.gmsh.write(str(path), mesh, fmt_version="4.1", binary=True)
