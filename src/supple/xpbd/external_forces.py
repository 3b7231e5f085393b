"""Loads beside gravity and contact: forces, and springs to target positions and between points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.loads.applied import DeadLoad
from supple.loads.springs import PointSpring
from supple.numerics.kernel_cache import njit
from supple.system import System


class ExternalForces:
    """The loads of a system, sorted by how they are applied.

    Arguments of the methods: points (n, 4) positions about the components' origins [m], and inverse masses [1/kg];
    velocities (n, 3) [m/s]; origins (n, 3) [m]; time of the end of the substep [s]; h, its length [s].
    """

    def __init__(self, system: System) -> None:
        loads = system.loads
        self._springs = [load for load in loads if isinstance(load, PointSpring)]
        self._pushes = [load for load in loads if not isinstance(load, PointSpring) and not load.is_internal]
        self._internal = [load for load in loads if load.is_internal]
        self._need_places = not all(isinstance(load, DeadLoad) for load in (*self._pushes, *self._internal))
        self._targets = system.soft_targets

    def add_forces(
        self,
        points: NDArray[np.float64],
        velocities: NDArray[np.float64],
        origins: NDArray[np.float64],
        time: float,
        h: float,
    ) -> None:
        """Add the loads to a prediction: v += h w f, x += h^2 w f.

        Internal ones change positions alone: like constraints, they change velocities where momenta are restored.
        """
        if not (self._pushes or self._internal):
            return
        forces = np.zeros_like(velocities)
        x = points[:, :3] + origins if self._need_places else points[:, :3]
        for load in self._pushes:
            load.add_forces(x, time, forces)
        inside = np.zeros_like(velocities)
        for load in self._internal:
            load.add_forces(x, time, inside)
        if self._pushes:
            _push(points, velocities, forces, h)
        if self._internal:
            _push(points, np.zeros_like(velocities), inside, h)

    def pull_springs(
        self,
        points: NDArray[np.float64],
        velocities: NDArray[np.float64],
        origins: NDArray[np.float64],
        time: float,
        h: float,
    ) -> None:
        """Project the springs between points: C = l - l0 with compliance 1 / k, one after the other.

        Dlam = -C / (sum w c^2 + 1 / (k h^2)), with the coefficients c of the vertices.
        """
        for spring in self._springs:
            rows, c = spring.vertices, spring.coefficients
            own = points[rows, :3] + origins[rows]
            r = c @ own + spring.offset
            length = float(np.sqrt(r @ r))
            weight = float(points[rows, 3] @ (c * c))
            if length > 0.0 and weight > 0.0:
                stretch = length - spring.rest_length(time)
                change = -stretch / (weight + 1.0 / (spring.stiffness * h * h)) / length * r
                moved = (points[rows, 3] * c)[:, None] * change
                points[rows, :3] += moved
                velocities[rows] += moved / h

    def pull_to_targets(
        self,
        points: NDArray[np.float64],
        velocities: NDArray[np.float64],
        origins: NDArray[np.float64],
        time: float,
        h: float,
    ) -> None:
        """Project the springs to soft targets: C = x - target with compliance 1 / k, all three components at once.

        Dlam = -C / (w + 1 / (k h^2)), as for any XPBD constraint. These forces are external, so they act after the
        momentum restore.
        """
        for target in self._targets:
            places = np.ascontiguousarray(target.targets(time))
            _pull(points, velocities, origins, target.vertices, places, target.target.stiffness, h)


@njit(cache=True)
def _push(points, velocities, forces, h):
    for i in range(len(points)):
        for j in range(3):
            change = h * points[i, 3] * forces[i, j]
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
