"""Rotations in the form that the browser uses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def quaternion(R: NDArray[np.float64]) -> NDArray[np.float64]:
    """(w, x, y, z) of a rotation (3, 3)."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(R).as_quat()[[3, 0, 1, 2]]


def turning_z_to(direction: NDArray[np.float64]) -> NDArray[np.float64]:
    """(w, x, y, z) of a rotation of the z axis to `direction` (3,), a unit vector."""
    from scipy.spatial.transform import Rotation

    return Rotation.align_vectors([direction], [[0.0, 0.0, 1.0]])[0].as_quat()[[3, 0, 1, 2]]
