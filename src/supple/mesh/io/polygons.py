"""Cutting surface cells into triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import (
    CELL_NAMES,
    PIXEL,
    POLYGON,
    QUAD,
    TRIANGLE,
    TRIANGLE_STRIP,
    CellSoup,
    FormatError,
    checked,
)

SURFACE_TYPES = (TRIANGLE, TRIANGLE_STRIP, POLYGON, PIXEL, QUAD)


def triangles_of(soup: CellSoup) -> NDArray[np.int64]:
    """Triangles (m, 3) of the surface cells; points and lines are passed over, solid cells refused.

    Convex polygons become fans, concave ones are cut by their ears.
    """
    soup = checked(soup)
    solid = np.unique(soup.types[soup.types > QUAD])
    if len(solid):
        name = CELL_NAMES.get(int(solid[0]), f"type {solid[0]}")
        hint = "; load it with TetMesh.load, whose .surface is the boundary" if name == "tetrahedron" else ""
        raise FormatError(f"it holds {name} cells, which are no surface{hint}")
    cells = np.flatnonzero(np.isin(soup.types, SURFACE_TYPES))
    if len(cells) == 0:
        raise FormatError("it holds no triangles or polygons")
    types, starts = soup.types[cells], soup.offsets[cells]
    sizes = soup.offsets[cells + 1] - starts
    if (sizes < 3).any():
        k = int(np.flatnonzero(sizes < 3)[0])
        raise FormatError(f"face {cells[k]} has {sizes[k]} corners; a face needs three at least")
    flat = _pixels_as_quads(soup.connectivity, starts[(types == PIXEL) & (sizes == 4)])

    # Triangle j of a cell is (corner 0, j + 1, j + 2) in a fan and (j, j + 1, j + 2), turned when j is odd, in a strip.
    counts = sizes - 2
    cell = np.repeat(np.arange(len(cells)), counts)
    j = np.arange(len(cell)) - np.repeat(np.cumsum(counts) - counts, counts)
    strip = types[cell] == TRIANGLE_STRIP
    first = starts[cell] + np.where(strip, j, 0)
    odd = strip & (j % 2 == 1)
    second, third = starts[cell] + j + 1, starts[cell] + j + 2
    triangles = flat[np.column_stack([first, np.where(odd, third, second), np.where(odd, second, third)])]
    return _mend_concave(soup.points, triangles, cell, (counts > 1) & (types != TRIANGLE_STRIP), (starts, sizes, flat))


def _pixels_as_quads(flat: NDArray[np.int64], starts: NDArray[np.int64]) -> NDArray[np.int64]:
    """A pixel lists its corners row by row; a quad goes around."""
    if len(starts) == 0:
        return flat
    flat = flat.copy()
    flat[starts + 2], flat[starts + 3] = flat[starts + 3], flat[starts + 2]
    return flat


def _mend_concave(
    points: NDArray[np.float64],
    triangles: NDArray[np.int64],
    cell: NDArray[np.int64],
    is_polygon: NDArray[np.bool_],
    cells: tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]],
) -> NDArray[np.int64]:
    """Replace the fans of polygons that a fan does not fit."""
    a, b, c = points[triangles].transpose(1, 0, 2)
    with np.errstate(all="ignore"):  # what is not finite is reported later, by vertex
        normals = np.cross(b - a, c - a)
        total = np.zeros((len(is_polygon), 3))
        np.add.at(total, cell, normals)
        wrong = is_polygon[cell] & (np.einsum("ij,ij->i", normals, total[cell]) < 0.0)
    starts, sizes, flat = cells
    for k in np.unique(cell[wrong]):
        rows = np.flatnonzero(cell == k)
        corners = flat[starts[k] : starts[k] + sizes[k]]
        triangles[rows] = corners[ear_clipped(points[corners], total[k])]
    return triangles


def ear_clipped(polygon: NDArray[np.float64], normal: NDArray[np.float64]) -> NDArray[np.int64]:
    """Triangles (k - 2, 3) of a simple, nearly flat polygon (k, 3), by cutting off ears (Meisters 1975)."""
    drop = int(np.abs(normal).argmax())
    keep = [(drop + 1) % 3, (drop + 2) % 3]
    plane = polygon[:, keep] * (1.0 if normal[drop] > 0.0 else -1.0, 1.0)

    def turn(i: int, j: int, k: int) -> float:
        (ax, ay), (bx, by), (cx, cy) = plane[i], plane[j], plane[k]
        return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)

    left = list(range(len(polygon)))
    triangles = []
    while len(left) > 3:
        best, best_at = None, 0
        for at in range(len(left)):
            i, j, k = left[at - 1], left[at], left[(at + 1) % len(left)]
            area = turn(i, j, k)
            inside = any(
                turn(i, j, p) >= 0.0 and turn(j, k, p) >= 0.0 and turn(k, i, p) >= 0.0
                for p in left
                if p not in (i, j, k)
            )
            # Among ears the largest; without any (a polygon that crosses itself) the least bad corner.
            score = (area > 0.0 and not inside, area)
            if best is None or score > best:
                best, best_at = score, at
        triangles.append((left[best_at - 1], left[best_at], left[(best_at + 1) % len(left)]))
        left.pop(best_at)
    triangles.append((left[0], left[1], left[2]))
    return np.array(triangles, dtype=np.int64)
