"""Gmsh's .msh, versions 2.2, 4.0 and 4.1, text and binary, through meshio."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from supple.mesh.formats.cells import POLYGON, QUAD, TETRA, TRIANGLE, CellSoup, FormatError, joined

# Blocks that may accompany tets, by meshio's names; whatever else a file holds is refused by name.
ACCEPTED = {"vertex": 1, "line": 3, "triangle": TRIANGLE, "quad": QUAD, "polygon": POLYGON, "tetra": TETRA}


def read(path: Path, data: bytes) -> CellSoup:
    """Points and cells of a .msh file."""
    import meshio

    _refuse_impossible_counts(data)
    try:
        # meshio warns on the terminal, and numpy of what it reads; an error says all that is needed.
        with (
            contextlib.redirect_stdout(io.StringIO()),
            contextlib.redirect_stderr(io.StringIO()),
            np.errstate(all="ignore"),
        ):
            mesh = meshio.gmsh.read(str(path))
    except (Exception, SystemExit) as error:  # meshio lets through whatever a damaged file causes
        said = f" ({error})" if isinstance(error, meshio.ReadError) and str(error) else ""
        raise FormatError(f"it cannot be read as a Gmsh file: damaged, truncated, or of another kind{said}") from None
    points = np.asarray(mesh.points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or len(points) == 0:
        raise FormatError("it holds no points in three dimensions")
    soups = []
    for block in mesh.cells:
        if block.type not in ACCEPTED:
            raise FormatError(f"it holds {block.type} cells; only linear tetrahedra can be used: convert or remesh it")
        if len(block.data):
            soups.append(CellSoup.of_rows(points[:0], np.asarray(block.data, dtype=np.int64), ACCEPTED[block.type]))
    if not soups:
        raise FormatError("it holds no cells")
    return joined(soups)._replace(points=points)


def _refuse_impossible_counts(data: bytes) -> None:
    """Counts beyond the file's size would make meshio ask for memory that the file cannot fill."""
    form = re.match(rb"\s*(?:\$Comments.*?\$EndComments\s*)?\$MeshFormat\s+(\S+)\s+(\d)\s", data, re.DOTALL)
    if form is None:
        raise FormatError("it does not begin with '$MeshFormat'; is it a Gmsh file?", 1)
    for section in (b"Nodes", b"Elements"):
        start = data.find(b"$" + section)
        if start < 0:
            raise FormatError(f"it has no section ${section.decode()}: it is truncated, or holds no mesh")
        at = data.find(b"\n", start) + 1
        if form.group(2) == b"0" or form.group(1).startswith(b"2"):
            counts = [int(w) for w in data[at : data.find(b"\n", at)].split() if w.lstrip(b"-").isdigit()][:2]
        else:
            counts = np.frombuffer(data[at : at + 16], dtype="<u8").tolist() if at + 16 <= len(data) else []
        if not counts or min(counts) < 0 or max(counts) > len(data):
            line = data.count(b"\n", 0, at) + 1 if form.group(2) == b"0" else None
            raise FormatError(f"the counts in ${section.decode()} do not fit a file of {len(data)} bytes", line)


def write(path: Path, vertices: NDArray[np.float64], tets: NDArray[np.int32]) -> None:
    """Version 4.1, binary."""
    import meshio

    with contextlib.redirect_stderr(io.StringIO()):
        mesh = meshio.Mesh(np.array(vertices), [("tetra", np.array(tets))])
        meshio.gmsh.write(str(path), mesh, fmt_version="4.1", binary=True)
