"""Rigid bodies in a step: the nearest rigid places, and how far from rigid the bodies are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.scene.rigid.pose import nearest_rigid, orthogonality_error
from supple.system import System


def make_rigid(system: System, x: NDArray[np.float64]) -> None:
    """Move the control points of every rigid body in x (n, 3) to the nearest rigid pose, in place."""
    for part in system.rigid_bodies:
        x[part.vertices] = nearest_rigid(system.rest_positions[part.vertices], x[part.vertices])


def orthogonality_errors(system: System, x: NDArray[np.float64]) -> dict[str, float]:
    """|F^T F - 1| of every rigid body at x (n, 3), by name."""
    return {
        part.name: orthogonality_error(system.rest_positions[part.vertices], x[part.vertices])
        for part in system.rigid_bodies
    }
