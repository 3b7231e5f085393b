"""A fine surface on coarse tets: each of its vertices is a fixed affine combination of the corners of one tet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from supple.mesh.skin import mixed
from supple.results.checkpoint.values import Rows


@dataclass(frozen=True, eq=False)
class SkinnedSurface:
    """Triangles whose vertices follow tets.

    Attributes
    ----------
    corners : (k, 4) int32, rows of the body's vertices: the tet that carries each surface vertex; (k, 10) the nodes of
        a quadratic one
    weights : (k, 4) barycentric coordinates in it, or (k, 10) shape functions, summing to one; negative
        where the vertex lies outside
    triangles : (t, 3) int32, rows of `corners`
    """

    corners: Annotated[NDArray[np.int32], Rows("k", "width", below="own")]
    weights: Annotated[NDArray[np.float64], Rows("k", "width")]
    triangles: Annotated[NDArray[np.int32], Rows("t", 3, below="k")]

    def positions(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Where the surface's vertices (k, 3) are when the body's are at x (n, 3) [m]."""
        return mixed(self.corners, self.weights, np.ascontiguousarray(x, dtype=np.float64))
