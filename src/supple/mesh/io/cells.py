"""The contents of a mesh file before conversion: points, and cells of any kind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

# Cell types by VTK's numbers.
TRIANGLE, TRIANGLE_STRIP, POLYGON, PIXEL, QUAD = 5, 6, 7, 8, 9
TETRA, VOXEL, HEXAHEDRON, WEDGE, PYRAMID, PENTAGONAL_PRISM, HEXAGONAL_PRISM = 10, 11, 12, 13, 14, 15, 16
QUADRATIC_TRIANGLE, QUADRATIC_TETRA = 22, 24
# The cells that are written, by their number of points.
CELL_OF_WIDTH = {3: TRIANGLE, 4: TETRA, 10: QUADRATIC_TETRA}


class CellKind(NamedTuple):
    """Names of a type of cells, its dimension, its number of corners (0: any), and the type that the corners make."""

    name: str
    plural: str
    dimension: int
    corners: int
    linear: int


_LINEAR = {
    1: ("vertex", "vertices", 0, 1),
    2: ("poly-vertex", "poly-vertices", 0, 0),
    3: ("line", "lines", 1, 2),
    4: ("poly-line", "poly-lines", 1, 0),
    TRIANGLE: ("triangle", "triangles", 2, 3),
    TRIANGLE_STRIP: ("triangle strip", "triangle strips", 2, 0),
    POLYGON: ("polygon", "polygons", 2, 0),
    PIXEL: ("pixel", "pixels", 2, 4),
    QUAD: ("quad", "quads", 2, 4),
    TETRA: ("tetrahedron", "tetrahedra", 3, 4),
    VOXEL: ("voxel", "voxels", 3, 8),
    HEXAHEDRON: ("hexahedron", "hexahedra", 3, 8),
    WEDGE: ("wedge", "wedges", 3, 6),
    PYRAMID: ("pyramid", "pyramids", 3, 5),
    PENTAGONAL_PRISM: ("pentagonal prism", "pentagonal prisms", 3, 10),
    HEXAGONAL_PRISM: ("hexagonal prism", "hexagonal prisms", 3, 12),
}
# Of higher order, with the type that their corners make, which come first: quadratic cells, then Lagrange, then Bezier.
_HIGHER = {
    21: 3, 22: 5, 23: 9, 24: 10, 25: 12, 26: 13, 27: 14, 28: 9, 29: 12, 30: 9, 31: 13, 32: 13, 33: 12, 34: 5, 35: 3,
    37: 14, 68: 3, 69: 5, 70: 9, 71: 10, 72: 12, 73: 13, 74: 14, 75: 3, 76: 5, 77: 9, 78: 10, 79: 12, 80: 13, 81: 14,
}  # fmt: skip
KINDS = {number: CellKind(*own, number) for number, own in _LINEAR.items()}
KINDS |= {
    number: KINDS[linear]._replace(name=f"{order} {KINDS[linear].name}", plural=f"{order} {KINDS[linear].plural}")
    for number, linear in _HIGHER.items()
    for order in ("quadratic" if number < 68 else "higher-order",)
}


class FormatError(Exception):
    """A file does not follow its format: the reason, and the line (1-based) where lines are known.

    line : of a file that the file names, the name of that one, a colon, and its line
    """

    def __init__(self, reason: str, line: int | str | None = None) -> None:
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
    """What a file holds.

    Attributes
    ----------
    soup : its points and cells
    node_sets, cell_sets : by name, rows of points, and of cells
    notes : what its reader left out or took otherwise, a line each
    up : the axis of the file that points up
    """

    soup: CellSoup
    node_sets: Mapping[str, NDArray[np.int64]] = {}
    cell_sets: Mapping[str, NDArray[np.int64]] = {}
    notes: Sequence[str] = ()
    up: str = "y"


def checked(soup: CellSoup) -> CellSoup:
    """The same soup, or a `FormatError` where an index points outside, or a cell is of an unknown type or too short."""
    flat = soup.connectivity
    outside = (flat < 0) | (flat >= len(soup.points))
    if outside.any():
        k = int(np.flatnonzero(outside)[0])
        cell = int(np.searchsorted(soup.offsets, k, side="right")) - 1
        raise FormatError(f"cell {cell} names point {flat[k]}, but points run from 0 to {len(soup.points) - 1}")
    sizes = np.diff(soup.offsets)
    for number in np.unique(soup.types):
        if number not in KINDS:
            name = {36: "quadratic polygon", 41: "convex point set", 42: "polyhedron"}.get(number, f"type {number}")
            raise FormatError(f"it has {name} cells, which cannot be read: convert or remesh it")
        kind, own = KINDS[number], soup.types == number
        wrong = own & (sizes < kind.corners if number in _HIGHER else (kind.corners > 0) & (sizes != kind.corners))
        if wrong.any():
            cell = int(np.flatnonzero(wrong)[0])
            raise FormatError(f"cell {cell} is a {kind.name} of {sizes[cell]} points, not {kind.corners}")
    return soup


def dimensions(soup: CellSoup) -> NDArray[np.int64]:
    """The dimension of each cell: 0 of points, 1 of lines, 2 of surfaces, 3 of solids."""
    table = np.full(256, -1)
    table[list(KINDS)] = [kind.dimension for kind in KINDS.values()]
    return table[soup.types]


def cut_to_corners(soup: CellSoup, cells: NDArray[np.bool_]) -> CellSoup:
    """The chosen cells, of which those of higher order keep their corners alone."""
    corners, linear = np.zeros(256, dtype=np.int64), np.arange(256)
    corners[list(_HIGHER)] = [KINDS[number].corners for number in _HIGHER]
    linear[list(_HIGHER)] = list(_HIGHER.values())
    sizes = np.diff(soup.offsets)
    kept = np.where(corners[soup.types] > 0, corners[soup.types], sizes)
    place = np.arange(len(soup.connectivity)) - np.repeat(soup.offsets[:-1], sizes)
    flat = soup.connectivity[(place < np.repeat(kept, sizes)) & np.repeat(cells, sizes)]
    return CellSoup.of_blocks(soup.points, [(linear[soup.types[cells]], kept[cells], flat)])
