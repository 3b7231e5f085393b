"""The convex hull of points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def convex_hull(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.integer]]:
    """The vertices and triangles of the convex hull of points (n, 3), facing outwards.

    Raises
    ------
    ValueError : where the points contain no volume.
    """
    from scipy.spatial import ConvexHull, QhullError

    try:
        found = ConvexHull(points)
    except QhullError:
        raise ValueError("the points contain no volume") from None
    triangles = found.simplices.astype(np.int64)
    a, b, c = points[triangles].transpose(1, 0, 2)
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), found.equations[:, :3]) < 0.0
    triangles[inward] = triangles[inward][:, [0, 2, 1]]
    used, compact = np.unique(triangles, return_inverse=True)
    return points[used], compact.reshape(-1, 3)
