"""The contents of a mesh file before conversion: points, and cells of any kind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

# Cell types by VTK's numbers.
TRIANGLE, TRIANGLE_STRIP, POLYGON, PIXEL, QUAD, TETRA = 5, 6, 7, 8, 9, 10
QUADRATIC_EDGE, QUADRATIC_TRIANGLE, QUADRATIC_TETRA = 21, 22, 24
# The cells that are written, by their number of points.
CELL_OF_WIDTH = {3: TRIANGLE, 4: TETRA, 10: QUADRATIC_TETRA}
CELL_NAMES = {
    1: "vertex", 2: "poly-vertex", 3: "line", 4: "poly-line", 5: "triangle", 6: "triangle strip", 7: "polygon",
    8: "pixel", 9: "quad", 10: "tetrahedron", 11: "voxel", 12: "hexahedron", 13: "wedge", 14: "pyramid",
    21: "quadratic edge", 22: "quadratic triangle", 24: "quadratic tetrahedron",
    25: "quadratic hexahedron", 42: "polyhedron",
}  # fmt: skip


class FormatError(Exception):
    """A file does not follow its format: the reason, and the line (1-based) where lines are known."""

    def __init__(self, reason: str, line: int | None = None) -> None:
        super().__init__(reason)
        self.reason = reason
        self.line = line


Block = tuple[int | NDArray, NDArray[np.int64], NDArray[np.int64]]


class CellSoup(NamedTuple):
    """Points (n, 3), and for each cell k its VTK type and its points connectivity[offsets[k] : offsets[k + 1]]."""

    points: NDArray[np.float64]
    types: NDArray[np.uint8]
    offsets: NDArray[np.int64]
    connectivity: NDArray[np.int64]

    @classmethod
    def of_polygons(cls, points: NDArray[np.float64], polygons: Sequence[Sequence[int]]) -> CellSoup:
        """Soup of polygons, given as lists of point indices."""
        sizes = np.fromiter((len(p) for p in polygons), dtype=np.int64, count=len(polygons))
        flat = np.fromiter((i for p in polygons for i in p), dtype=np.int64, count=int(sizes.sum()))
        return cls.of_blocks(points, [(POLYGON, sizes, flat)])

    @classmethod
    def of_rows(cls, points: NDArray[np.float64], rows: NDArray[np.int64], cell_type: int) -> CellSoup:
        """Soup of cells of one type (m, corners)."""
        return cls.of_blocks(points, [(cell_type, np.full(len(rows), rows.shape[1]), rows.ravel())])

    @classmethod
    def of_blocks(cls, points: NDArray[np.float64], blocks: Sequence[Block]) -> CellSoup:
        """Soup of blocks of cells: the type of all or of each, the size of each, and the point indices of all."""
        nothing = np.empty(0, dtype=np.int64)
        sizes = np.concatenate([nothing, *(sizes for _, sizes, _ in blocks)])
        types = np.concatenate([nothing, *(np.broadcast_to(types, sizes.shape) for types, sizes, _ in blocks)])
        flat = np.concatenate([nothing, *(flat for _, _, flat in blocks)])
        offsets = np.concatenate([[0], np.cumsum(sizes)])
        return cls(points, types.astype(np.uint8), offsets.astype(np.int64), flat.astype(np.int64))


class MeshFile(NamedTuple):
    """Points and cells of a file, and by name the rows of points, and of its tets, that belong to named sets."""

    soup: CellSoup
    node_sets: Mapping[str, NDArray[np.int64]] = {}
    tet_sets: Mapping[str, NDArray[np.int64]] = {}


def checked(soup: CellSoup) -> CellSoup:
    """The same soup, or a `FormatError` where an index points outside."""
    flat = soup.connectivity
    outside = (flat < 0) | (flat >= len(soup.points))
    if outside.any():
        k = int(np.flatnonzero(outside)[0])
        cell = int(np.searchsorted(soup.offsets, k, side="right")) - 1
        raise FormatError(f"cell {cell} names point {flat[k]}, but points run from 0 to {len(soup.points) - 1}")
    return soup


def tets_of(soup: CellSoup) -> NDArray[np.int64]:
    """The tets of a soup, (m, 4) or, of quadratic ones, (m, 10) in VTK's order of nodes.

    Points, lines and surface cells are ignored; other cells, and tets of both kinds together, are errors.
    """
    soup = checked(soup)
    solid = (soup.types > QUAD) & (soup.types != QUADRATIC_EDGE) & (soup.types != QUADRATIC_TRIANGLE)
    kinds = np.unique(soup.types[solid])
    others = kinds[(kinds != TETRA) & (kinds != QUADRATIC_TETRA)]
    if len(others):
        name = CELL_NAMES.get(int(others[0]), f"type {others[0]}")
        raise FormatError(f"it has {name} cells; only tetrahedra of 4 or 10 nodes can be used: convert or remesh it")
    if len(kinds) == 0:
        raise FormatError(
            "it has no tetrahedra; a surface is loaded with SurfaceMesh.load and meshed with tetrahedralize"
        )
    if len(kinds) == 2:
        raise FormatError("it has both linear and quadratic tetrahedra; save it with one kind")
    width = 4 if kinds[0] == TETRA else 10
    cells = np.flatnonzero(solid)
    starts, sizes = soup.offsets[cells], soup.offsets[cells + 1] - soup.offsets[cells]
    if (sizes != width).any():
        cell = int(cells[np.flatnonzero(sizes != width)[0]])
        raise FormatError(
            f"cell {cell} is a {CELL_NAMES[int(kinds[0])]} of {soup.offsets[cell + 1] - soup.offsets[cell]} points, "
            f"not {width}"
        )
    return soup.connectivity[starts[:, None] + np.arange(width)]
