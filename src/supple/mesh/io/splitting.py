"""Solid cells of any kind as tets, so that neighbours fit.

A cell is split from its vertex of the smallest number: each face without that vertex is cut into triangles from its own
vertex of the smallest number, and each triangle makes a tet. The cut of a face depends on the numbers of its vertices
alone, so that both cells beside it cut it alike. Where such a tet would be flat or inverted, because faces are warped,
the tets meet in a new vertex in the middle of the cell: the cuts of its faces stay.

Source: Dompierre, Labbe, Vallet, Camarero (1999), "How to subdivide pyramids, prisms and hexahedra into tetrahedra".
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import (
    HEXAGONAL_PRISM,
    HEXAHEDRON,
    KINDS,
    PENTAGONAL_PRISM,
    PYRAMID,
    QUADRATIC_TETRA,
    TETRA,
    VOXEL,
    WEDGE,
    CellSoup,
    FormatError,
    checked,
    cut_to_corners,
    dimensions,
)
from supple.mesh.io.polygons import triangles_of
from supple.mesh.topology import has_vertex_twice


def cells_of(soup: CellSoup) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The tets (m, 4) and triangles (t, 3) of a soup; of quadratic cells the corners, of other solids their tets."""
    soup = checked(soup)
    tets, triangles = np.zeros((0, 4), dtype=np.int64), triangles_of(soup)
    if (dimensions(soup) == 3).any():
        split = tets_of(soup)
        if len(split.points) > len(soup.points):
            raise FormatError("it has warped cells, which cannot be split without new vertices: convert it to tets")
        tets = split.tets[:, :4]
    if len(tets) + len(triangles) == 0:
        raise FormatError("it has neither solid cells nor triangles")
    return tets, triangles


# Below this part of the cube of its cell's size, six times the volume of a tet is round-off.
_FLAT = 1e-12


def _prism(n: int) -> list[list[int]]:
    """Faces of the prism over a polygon: counter-clockwise seen from outside where its bottom is so seen from above."""
    sides = [[k, (k + 1) % n, n + (k + 1) % n, n + k] for k in range(n)]
    return [list(range(n))[::-1], list(range(n, 2 * n)), *sides]


_FACES = {
    WEDGE: _prism(3),
    HEXAHEDRON: _prism(4),
    PENTAGONAL_PRISM: _prism(5),
    HEXAGONAL_PRISM: _prism(6),
    PYRAMID: [[3, 2, 1, 0], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
}


class Tets(NamedTuple):
    """Points (n, 3), tets (m, 4) or (m, 10), the cell (m,) that each is of, and what was changed, a line each."""

    points: NDArray[np.float64]
    tets: NDArray[np.int64]
    cells: NDArray[np.int64]
    notes: list[str]


def tets_of(soup: CellSoup) -> Tets:
    """The tets of a checked soup: of ten nodes where all its solids are, otherwise those of the solids' corners."""
    solid = dimensions(soup) == 3
    cells = np.flatnonzero(solid)
    kinds = np.unique(soup.types[solid])
    whole = len(kinds) == 1 and kinds[0] == QUADRATIC_TETRA
    if whole or (len(kinds) == 1 and kinds[0] == TETRA):
        width = 10 if whole else 4
        if (np.diff(soup.offsets)[cells] != width).any():
            raise FormatError(f"its quadratic tetrahedra do not have {width} points each")
        return Tets(soup.points, soup.connectivity[soup.offsets[cells][:, None] + np.arange(width)], cells, [])
    linear = cut_to_corners(soup, solid)
    points, rows, owners, tet_count, middles = soup.points, [], [], 0, 0
    for number in np.unique(linear.types):
        own = np.flatnonzero(linear.types == number)
        corners = linear.connectivity[linear.offsets[own][:, None] + np.arange(KINDS[number].corners)]
        if number == TETRA:
            rows.append(corners)
            owners.append(cells[own])
            continue
        if number == VOXEL:  # row by row
            number, corners = HEXAHEDRON, corners[:, [0, 1, 3, 2, 4, 5, 7, 6]]
        tets, cell, points, new = _split(corners, int(number), points, cells[own])
        rows.append(tets)
        owners.append(cells[own][cell])
        tet_count, middles = tet_count + len(tets), middles + new
    cell = np.concatenate(owners)
    order = np.argsort(cell, kind="stable")
    return Tets(points, np.concatenate(rows)[order], cell[order], _said(soup.types[solid], tet_count, middles))


def _said(types: NDArray[np.uint8], tet_count: int, middles: int) -> list[str]:
    """What became of solids of these types: how many were split into how many tets, and which were cut to corners."""
    numbers, counts = np.unique(types, return_counts=True)
    of = {KINDS[int(number)]: int(count) for number, count in zip(numbers, counts, strict=True)}
    split = {kind: count for kind, count in of.items() if kind.linear != TETRA}
    notes = []
    if split:
        names = " and ".join(f"{count:,} {kind.name if count == 1 else kind.plural}" for kind, count in split.items())
        by = " by their corners" if any(kind.name != KINDS[kind.linear].name for kind in split) else ""
        new = "1 new vertex in the middle of a warped one" if middles == 1 else f"{middles:,} new ones in warped cells"
        middle = f", with {new}" if middles else ""
        were = "was" if sum(split.values()) == 1 else "were"
        notes.append(f"{names} {were} split{by} into {tet_count:,} tets{middle}")
    curved = sum(count for kind, count in of.items() if kind.linear == TETRA and kind.name != KINDS[TETRA].name)
    if curved:
        notes.append(f"of {curved:,} {KINDS[QUADRATIC_TETRA].plural}, only the corners are used")
    return notes


def _split(
    corners: NDArray[np.int64], number: int, points: NDArray[np.float64], cells: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64], int]:
    """Tets (m, 4) of cells (k, corners) of one kind, the row of each, the points with new ones, and how many these are.

    cells : (k,) the number of each cell in the file, for errors
    """
    triangles = np.concatenate([_fan(corners[:, face]) for face in _FACES[number]], axis=1)
    k, per_cell = triangles.shape[:2]
    whole = ~has_vertex_twice(triangles.reshape(-1, 3)).reshape(k, per_cell)  # a cell may have a corner twice
    first = corners.min(axis=1)
    cell, face = np.nonzero(whole & (triangles != first[:, None, None]).all(axis=2))
    tets = np.column_stack([first[cell], triangles[cell, face]])
    low, high = points[corners].min(axis=1), points[corners].max(axis=1)
    flat = _FLAT * (high - low).max(axis=1) ** 3
    with np.errstate(all="ignore"):  # coordinates that are not finite are reported later, with their vertex
        det = _determinants(points, tets)
        sign = np.where(np.bincount(cell, det, minlength=k) < 0.0, -1.0, 1.0)  # formats differ in the order of wedges
        warped = np.bincount(cell, minlength=k) == 0
        warped[cell[sign[cell] * det <= flat[cell]]] = True
    if warped.any():
        rows = np.flatnonzero(warped)
        middle = np.full(k, -1)
        middle[rows] = len(points) + np.arange(len(rows))
        points = np.concatenate([points, points[corners[rows]].mean(axis=1)])
        again, face = np.nonzero(whole & warped[:, None])
        around = np.column_stack([middle[again], triangles[again, face]])
        det = _determinants(points, around)
        sign[rows] = np.where(np.bincount(again, det, minlength=k)[rows] < 0.0, -1.0, 1.0)
        folded = again[sign[again] * det <= flat[again]]
        folded = np.union1d(folded, np.setdiff1d(rows, again))
        if len(folded):
            at = int(folded[0])
            raise FormatError(
                f"cell {cells[at]} (counted from 0) is a {KINDS[number].name} that is flat or folds over itself, at "
                f"{tuple(points[middle[at]].round(6).tolist())}; repair it in the program that made the mesh"
            )
        kept = ~warped[cell]
        tets, cell = np.concatenate([tets[kept], around]), np.concatenate([cell[kept], again])
    reoriented = sign[cell] < 0.0
    tets[reoriented] = tets[reoriented][:, [0, 1, 3, 2]]
    return tets, cell, points, int(warped.sum())


def _fan(polygons: NDArray[np.int64]) -> NDArray[np.int64]:
    """Triangles (k, n - 2, 3) of polygons (k, n), from the vertex with the smallest number."""
    n = polygons.shape[1]
    start = polygons.argmin(axis=1)[:, None]
    rotated = np.take_along_axis(polygons, (start + np.arange(n)) % n, axis=1)
    return np.stack([rotated[:, [0, j, j + 1]] for j in range(1, n - 1)], axis=1)


def _determinants(points: NDArray[np.float64], tets: NDArray[np.int64]) -> NDArray[np.float64]:
    x0, x1, x2, x3 = points[tets].transpose(1, 0, 2)
    return np.einsum("ij,ij->i", x1 - x0, np.cross(x2 - x0, x3 - x0))
