"""Cutting surface cells into triangles."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import (
    PIXEL,
    TRIANGLE_STRIP,
    CellSoup,
    FormatError,
    cut_to_corners,
    dimensions,
)

MOST_CORNERS = 4_000  # of a concave face: the time to cut it grows with their square, and is seconds here


def triangles_of(soup: CellSoup) -> NDArray[np.int64]:
    """Triangles (m, 3) of the surface cells of a checked soup, of higher order by their corners; none are allowed.

    Convex polygons are cut as fans, concave ones by their ears.
    """
    soup = cut_to_corners(soup, dimensions(soup) == 2)
    if len(soup.types) == 0:
        return np.zeros((0, 3), dtype=np.int64)
    cells = np.arange(len(soup.types))
    types, starts = soup.types, soup.offsets[:-1]
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
    return _with_concave_cut(
        soup.points, triangles, cell, (counts > 1) & (types != TRIANGLE_STRIP), (starts, sizes, flat)
    )


def _pixels_as_quads(flat: NDArray[np.int64], starts: NDArray[np.int64]) -> NDArray[np.int64]:
    """A pixel lists its corners row by row; a quad goes around."""
    if len(starts) == 0:
        return flat
    flat = flat.copy()
    flat[starts + 2], flat[starts + 3] = flat[starts + 3], flat[starts + 2]
    return flat


def _with_concave_cut(
    points: NDArray[np.float64],
    triangles: NDArray[np.int64],
    cell: NDArray[np.int64],
    is_polygon: NDArray[np.bool_],
    cells: tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]],
) -> NDArray[np.int64]:
    """The triangles, with ears instead of the fan where a polygon is concave."""
    a, b, c = points[triangles].transpose(1, 0, 2)
    with np.errstate(all="ignore"):  # coordinates that are not finite are reported later, with their vertex
        normals = np.cross(b - a, c - a)
        total = np.zeros((len(is_polygon), 3))
        np.add.at(total, cell, normals)
        wrong = is_polygon[cell] & (np.einsum("ij,ij->i", normals, total[cell]) < 0.0)
    starts, sizes, flat = cells
    for k in np.unique(cell[wrong]):
        if sizes[k] > MOST_CORNERS:
            raise FormatError(
                f"a concave face has {sizes[k]} corners; at most {MOST_CORNERS} are possible: cut it into triangles in "
                "the program that wrote it"
            )
        corners = flat[starts[k] : starts[k] + sizes[k]]
        cut = ear_clipped(points[corners], total[k])
        if cut is not None:
            first = np.searchsorted(cell, k)
            triangles[first : first + len(cut)] = corners[cut]
    return triangles


def ear_clipped(polygon: NDArray[np.float64], normal: NDArray[np.float64]) -> NDArray[np.int64] | None:
    """Triangles (k - 2, 3) of a simple, nearly flat polygon (k, 3); None where it crosses itself.

    Source: ear clipping (Meisters 1975). A cut changes which corners are ears only beside it.
    """
    drop = int(np.abs(normal).argmax())
    axes = [(drop + 1) % 3, (drop + 2) % 3]
    plane = polygon[:, axes if normal[drop] > 0.0 else axes[::-1]]  # counter-clockwise
    plane = plane / (np.abs(plane).max() or 1.0)  # products of coordinates must not overflow
    count = len(plane)
    corners = np.arange(count)
    before, after = np.roll(corners, 1), np.roll(corners, -1)
    into, out = plane - plane[before], plane[after] - plane
    hollow = plane[into[:, 0] * out[:, 1] <= into[:, 1] * out[:, 0]]  # only these corners can be in an ear
    waiting, triangles, cut = deque(corners.tolist()), [], set()
    while waiting and len(triangles) < count - 2:
        k = waiting.popleft()
        ear = [before[k], k, after[k]]
        if k not in cut and _is_ear(plane[ear], hollow):
            triangles.append(ear)
            cut.add(k)
            after[before[k]], before[after[k]] = after[k], before[k]
            waiting += (int(before[k]), int(after[k]))
    return np.array(triangles) if len(triangles) == count - 2 else None


def _is_ear(ear: NDArray[np.float64], others: NDArray[np.float64]) -> bool:
    """Whether three corners (3, 2) turn left, and none of the others (n, 2) at another place is in their triangle."""
    edges = np.roll(ear, -1, axis=0) - ear
    if edges[0, 0] * edges[1, 1] <= edges[0, 1] * edges[1, 0]:
        return False
    apart = others[:, None] - ear
    within = (edges[:, 0] * apart[..., 1] >= edges[:, 1] * apart[..., 0]).all(axis=-1)
    return not (within & apart.any(axis=-1).all(axis=-1)).any()
