"""Loads beside gravity and contact: forces, and springs to target positions and between points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.model.loads.applied import DeadLoad, DragLoad
from supple.model.loads.growth import GrownTets
from supple.model.loads.springs import PointSpring
from supple.model.system import System
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.moment import Substep


class ExternalForces:
    """The loads of a system, sorted by how they are applied.

    Attributes
    ----------
    push, pull : whether any change a prediction, and whether any act after constraints
    acting : the forces of the present substep: the name of their work, their vertices, and (k, 3) [N]
    """

    def __init__(self, system: System) -> None:
        loads = system.loads
        self._springs = [load for load in loads if isinstance(load, PointSpring)]
        self._drags = [load for load in loads if isinstance(load, DragLoad)]
        self._pushes = [load for load in loads if not isinstance(load, (PointSpring, GrownTets, DragLoad))]
        self._need_places = not all(isinstance(load, DeadLoad) for load in self._pushes)
        self._targets = system.soft_targets
        self.push, self.pull = bool(self._pushes or self._drags), bool(self._springs or self._targets)
        self.acting: list[tuple[str, NDArray[np.integer] | slice, NDArray[np.float64]]] = []

    def add_forces(self, at: Substep) -> None:
        """Add the loads to a prediction: v += h w f, x += h^2 w f.

        Internal ones change positions alone: like constraints, they change velocities where momenta are restored.
        """
        self.acting = []
        x = at.world() if self._need_places else at.points[:, :3]
        for load in self._pushes:
            forces = np.zeros_like(at.velocities)
            load.add_forces(x, at.time, forces)
            self.acting.append((load.work, slice(None), forces))
        for load, (_, _, forces) in zip(self._pushes, self.acting, strict=True):
            _push(at.points, np.zeros_like(forces) if load.is_internal else at.velocities, forces, at.h)
        for load in self._drags:
            self._drag(load, at)

    def _drag(self, load: DragLoad, at: Substep) -> None:
        """The forces c (w - v') with the velocity v' after them: v' = (v + h c w / m) / (1 + h c / m)."""
        c = load.coefficients(at.begun + at.origins, at.velocities, at.time)[:, None]
        forces = c * (load.value(at.time) - at.velocities) / (1.0 + at.h * c * at.points[:, 3:])
        self.acting.append((load.work, slice(None), forces))
        _push(at.points, at.velocities, forces, at.h)

    def pull_springs(self, at: Substep) -> None:
        """Project the springs between points: C = l - l0 with compliance 1 / k, one after the other.

        Dlam = -C / (sum w c^2 + 1 / (k h^2)), with the coefficients c of the vertices. The direction is that of the
        beginning of the substep, see `ActuatorProjection`.
        """
        for spring in self._springs:
            rows, c = spring.vertices, spring.coefficients
            r = c @ at.world(rows) + spring.offset
            length = float(np.sqrt(r @ r))
            begun = c @ (at.begun[rows] + at.origins[rows]) + spring.offset
            if begun @ r > 0.0:
                r = begun * (length / np.sqrt(begun @ begun))
            w = at.points[rows, 3]
            if length > 0.0:
                stretch = length - spring.rest_length(at.time)
                pull = -stretch / (at.h**2 * float(w @ (c * c)) + 1.0 / spring.stiffness) / length * r
                forces = c[:, None] * pull
                moved = at.h**2 * w[:, None] * forces
                at.points[rows, :3] += moved
                at.velocities[rows] += moved / at.h
                self.acting.append((spring.work, rows, forces))

    def pull_to_targets(self, at: Substep) -> None:
        """Project the springs to soft targets: C = x - target with compliance 1 / k, all three components at once.

        Dlam = -C / (w + 1 / (k h^2)), as for any XPBD constraint. These forces are external, so they act after the
        momentum restore.
        """
        for target in self._targets:
            places = np.ascontiguousarray(target.targets(at.time))
            forces = np.zeros_like(places)
            stiffness = np.broadcast_to(target.target.stiffness, 3).copy()
            _pull(at.points, at.velocities, at.origins, target.vertices, places, stiffness, at.h, forces)
            self.acting.append(("soft_targets", target.vertices, forces))


@njit(cache=True)
def _push(points, velocities, forces, h):
    for i in range(len(points)):
        for j in range(3):
            change = h * points[i, 3] * forces[i, j]
            velocities[i, j] += change
            points[i, j] += h * change


@njit(cache=True)
def _pull(points, velocities, origins, vertices, places, stiffness, h, forces):
    for k in range(len(vertices)):
        i = vertices[k]
        for j in range(3):
            pull = points[i, 3] * stiffness[j] * h * h
            forces[k, j] = (places[k, j] - origins[i, j] - points[i, j]) * stiffness[j] / (1.0 + pull)
            change = h * points[i, 3] * forces[k, j]
            points[i, j] += h * change
            velocities[i, j] += change
