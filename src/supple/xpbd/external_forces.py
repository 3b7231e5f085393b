"""External loads beside gravity and contact: forces on vertices, and springs to target positions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.numerics.kernel_cache import njit
from supple.system import System


def add_forces(
    system: System, points: NDArray[np.float64], velocities: NDArray[np.float64], time: float, h: float
) -> None:
    """Add the forces at `time` to a prediction: v += h w f, x += h^2 w f.

    Parameters
    ----------
    points : (n, 4) positions about the components' origins [m], and inverse masses [1/kg]; velocities : (n, 3) [m/s]
    """
    for force in system.forces:
        _push(points, velocities, force.vertices, np.ascontiguousarray(force.per_vertex(time)), h)


def pull_to_targets(
    system: System,
    points: NDArray[np.float64],
    velocities: NDArray[np.float64],
    origins: NDArray[np.float64],
    time: float,
    h: float,
) -> None:
    """Project the springs to soft targets: C = x - target with compliance 1 / k, all three components at once.

    Dlam = -C / (w + 1 / (k h^2)), as for any XPBD constraint. These forces are external, so they act after the momentum
    restore. `points` and `velocities` as in `add_forces`, origins (n, 3) [m].
    """
    for target in system.soft_targets:
        places = np.ascontiguousarray(target.targets(time))
        _pull(points, velocities, origins, target.vertices, places, target.target.stiffness, h)


@njit(cache=True)
def _push(points, velocities, vertices, forces, h):
    for k in range(len(vertices)):
        i = vertices[k]
        for j in range(3):
            change = h * points[i, 3] * forces[k, j]
            velocities[i, j] += change
            points[i, j] += h * change


@njit(cache=True)
def _pull(points, velocities, origins, vertices, places, stiffness, h):
    for k in range(len(vertices)):
        i = vertices[k]
        pull = points[i, 3] * stiffness * h * h
        for j in range(3):
            change = (places[k, j] - origins[i, j] - points[i, j]) * pull / (1.0 + pull)
            points[i, j] += change
            velocities[i, j] += change / h
