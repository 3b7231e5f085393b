"""Gmsh's .msh by meshio: versions 2, 4.0 and 4.1, text and binary, with its physical groups."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import QUADRATIC_TETRA, TETRA, CellSoup, FormatError, MeshFile
from supple.mesh.io.in_child import read_in_child
from supple.mesh.io.text import without_mark

_TETS = {"tetra": TETRA, "tetra10": QUADRATIC_TETRA}


def read_msh(data: bytes) -> MeshFile:
    """Tets and physical groups of a .msh file."""
    if not without_mark(data).lstrip().startswith((b"$MeshFormat", b"$Comments")):
        raise FormatError("it does not begin with '$MeshFormat'; is it a Gmsh file?", 1)
    for section in ("Nodes", "Elements"):  # meshio takes what is there of one that is cut off
        if f"$End{section}".encode() not in data:
            raise FormatError(f"it has no $End{section}: it is truncated, or has no mesh")
    return read_in_child(without_mark(data), "meshio", ".msh")


def read_file(path: Path) -> MeshFile:
    """The same, in this process."""
    import meshio

    mesh = meshio.gmsh.read(path)
    for block in mesh.cells:
        if block.dim == 3 and block.type not in _TETS:
            raise FormatError(
                f"it has {block.type} cells; only tetrahedra of 4 or 10 nodes can be used: convert or remesh it"
            )
    starts = dict.fromkeys(range(len(mesh.cells)), 0)
    count = 0
    for k, block in enumerate(mesh.cells):
        if block.dim == 3:
            starts[k], count = count, count + len(block.data)
    node_sets: dict[str, NDArray[np.int64]] = {}
    tet_sets: dict[str, NDArray[np.int64]] = {}
    for name, (number, dimension) in mesh.field_data.items():
        rows = _rows_of(mesh, name, int(number), int(dimension))
        members = [np.asarray(block.data)[own].ravel() for block, own in zip(mesh.cells, rows, strict=True)]
        nodes = np.unique(np.concatenate(members)).astype(np.int64)
        if len(nodes):
            node_sets[name] = nodes
            if dimension == 3:
                tet_sets[name] = np.concatenate([starts[k] + own for k, own in enumerate(rows)]).astype(np.int64)
    solid = [
        (_TETS[block.type], np.full(*np.shape(block.data)), np.ravel(block.data).astype(np.int64))
        for block in mesh.cells
        if block.dim == 3
    ]
    return MeshFile(CellSoup.of_blocks(np.asarray(mesh.points, dtype=np.float64), solid), node_sets, tet_sets)


def _rows_of(mesh, name: str, number: int, dimension: int) -> list[NDArray[np.integer]]:
    """Which cells of each block are of a group. Version 4.1 has groups of entities, others a number for each cell."""
    if name in mesh.cell_sets:
        return [np.zeros(0, dtype=np.int64) if rows is None else np.asarray(rows) for rows in mesh.cell_sets[name]]
    groups = mesh.cell_data.get("gmsh:physical", [[]] * len(mesh.cells))
    pairs = zip(mesh.cells, groups, strict=True)
    return [np.flatnonzero((np.asarray(own) == number) & (block.dim == dimension)) for block, own in pairs]


def write_msh(path: Path, vertices: NDArray[np.float64], tets: NDArray[np.int32]) -> None:
    """Version 4.1, binary."""
    import meshio

    with contextlib.redirect_stderr(io.StringIO()):
        kind = "tetra" if tets.shape[1] == 4 else "tetra10"
        mesh = meshio.Mesh(np.array(vertices), [(kind, np.array(tets))])
        meshio.gmsh.write(str(path), mesh, fmt_version="4.1", binary=True)
