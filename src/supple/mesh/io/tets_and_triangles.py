"""The tets and triangles of cells of any kind."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import (
    CELL_NAMES,
    QUADRATIC_EDGE,
    QUADRATIC_TETRA,
    QUADRATIC_TRIANGLE,
    TETRA,
    CellSoup,
    FormatError,
    checked,
)
from supple.mesh.io.polygons import SURFACE_TYPES, triangles_of

_CORNERS = {QUADRATIC_TRIANGLE: 3, TETRA: 4, QUADRATIC_TETRA: 4}


def cells_of(soup: CellSoup) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The tets (m, 4) and triangles (t, 3) of a soup; of quadratic cells the corners."""
    soup = checked(soup)
    known = np.isin(soup.types, (*SURFACE_TYPES, *_CORNERS, QUADRATIC_EDGE)) | (soup.types <= 4)
    if not known.all():
        kind = int(soup.types[~known][0])
        raise FormatError(
            f"it has {CELL_NAMES.get(kind, f'type {kind}')} cells; tetrahedra and surfaces can be checked: convert it"
        )
    tets = np.concatenate([_corners(soup, kind) for kind in (TETRA, QUADRATIC_TETRA)])
    flat = np.isin(soup.types, SURFACE_TYPES)
    triangles = _corners(soup, QUADRATIC_TRIANGLE)
    if flat.any():
        rows = np.flatnonzero(flat)
        sizes = np.diff(soup.offsets)[rows]
        chosen = np.repeat(flat, np.diff(soup.offsets))
        block = soup.types[rows], sizes, soup.connectivity[chosen]
        triangles = np.concatenate([triangles, triangles_of(CellSoup.of_blocks(soup.points, [block]))])
    if len(tets) + len(triangles) == 0:
        raise FormatError("it has neither tetrahedra nor triangles")
    return tets, triangles


def _corners(soup: CellSoup, kind: int) -> NDArray[np.int64]:
    rows = np.flatnonzero(soup.types == kind)
    width = _CORNERS[kind]
    if (np.diff(soup.offsets)[rows] < width).any():
        raise FormatError(f"a {CELL_NAMES[kind]} has fewer than {width} corners")
    return soup.connectivity[soup.offsets[rows][:, None] + np.arange(width)]
