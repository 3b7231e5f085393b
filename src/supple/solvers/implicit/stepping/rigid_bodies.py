"""Rigid bodies in a step: the nearest rigid places, how far from rigid bodies are, and forces on welded vertices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.model.system import System
from supple.scene.rigid.pose import nearest_rigid, orthogonality_error


def with_rigid_bodies(system: System, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Positions x (n, 3), with every rigid body moved in place to the nearest rigid pose."""
    for part in system.rigid_bodies:
        x[part.vertices] = nearest_rigid(system.rest_positions[part.vertices], x[part.vertices])
    return x


def orthogonality_errors(system: System, x: NDArray[np.float64]) -> dict[str, float]:
    """|F^T F - 1| of every rigid body at x (n, 3), by name."""
    return {
        part.name: orthogonality_error(system.rest_positions[part.vertices], x[part.vertices])
        for part in system.rigid_bodies
    }


def weld_forces(system: System, gradient: NDArray[np.float64]) -> dict[str, NDArray]:
    """The forces (3,) of rigid bodies on the vertices that are welded to them, by name of the weld [N].

    Parameters
    ----------
    gradient : (n, 3) of the whole objective at the end of a step [N]
    """
    welding, welds = system.welding, system.scene.welds
    shares = gradient[welding.vertices]
    return {str(weld.name): shares[welding.weld == k].sum(axis=0) for k, weld in enumerate(welds)}
