"""The tets and triangles of cells of any kind."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import CellSoup, FormatError, checked, dimensions
from supple.mesh.io.polygons import triangles_of
from supple.mesh.io.splitting import tets_of


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
