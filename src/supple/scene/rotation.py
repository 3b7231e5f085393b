"""Rotation vectors: the axis, as long as the angle in radians."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def rotation_matrix(vector: ArrayLike) -> NDArray[np.float64]:
    """The matrix R (3, 3) that turns by |vector| radians about `vector` (3,): x -> R x.

    R = I + sin(a) K + 2 sin(a/2)^2 K^2, with K the cross-product matrix of the unit axis (Rodrigues). The half angle
    keeps small angles exact where 1 - cos(a) would cancel.
    """
    vector = np.asarray(vector, dtype=np.float64)
    angle = float(np.linalg.norm(vector))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = vector / angle
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * K + 2.0 * np.sin(0.5 * angle) ** 2 * (K @ K)
