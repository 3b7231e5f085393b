"""Loads beside gravity and contact: forces, and springs to target positions and between points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.model.loads.applied import AppliedLoad, DeadLoad, DragLoad
from supple.model.loads.growth import GrownTets
from supple.model.loads.springs import PointSpring
from supple.model.system import System
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.assessment.acting import Acting
from supple.solvers.xpbd.moment import Substep

Rows, Forces = NDArray[np.int64], NDArray[np.float64]


class ExternalForces:
    """The loads of a system, sorted by how they are applied.

    Attributes
    ----------
    push, pull : whether any change a prediction, and whether any act after constraints
    acting : the forces of the present substep
    """

    def __init__(self, system: System) -> None:
        loads = system.loads
        pushes = [load for load in loads if not isinstance(load, (PointSpring, GrownTets, DragLoad))]
        drags = [load for load in loads if isinstance(load, DragLoad)]
        springs = [load for load in loads if isinstance(load, PointSpring)]
        applied = [(load.work, load.acts_on()) for load in (*pushes, *drags)]
        pulling = [("soft_targets", target.vertices) for target in system.soft_targets]
        pulling += [(spring.work, spring.vertices) for spring in springs]
        acting = [*applied, *pulling]
        self.acting = Acting([name for name, _ in acting], [vertices for _, vertices in acting])
        parts = iter(self.acting.parts)  # in the order of the names
        pushed = [(load, *next(parts)) for load in pushes]
        self._steady = [one for one in pushed if one[0].is_steady]
        self._changing = [one for one in pushed if not one[0].is_steady]
        self._drags = [(load, *next(parts)) for load in drags]
        self._targets = [(target, *next(parts)) for target in system.soft_targets]
        self._springs = [(spring, *next(parts)) for spring in springs]
        self._internal = np.array([load.is_internal for load in pushes], dtype=np.bool_)
        self._need_places = not all(isinstance(load, DeadLoad) for load, *_ in self._changing)
        self.push, self.pull = bool(applied), bool(springs or system.soft_targets)
        self._total = np.zeros((len(system.masses), 3))

    def begin_frame(self, at: Substep) -> None:
        """Begin a frame, of which this is the first substep."""
        self.acting.works[:], self.acting.forces[:] = 0.0, 0.0
        self._find(self._steady, at.points[:, :3], at.time)

    def add_forces(self, at: Substep) -> None:
        """Add the loads to a prediction: v += h w f, x += h^2 w f.

        Internal ones change positions alone: like constraints, they change velocities where momenta are restored.
        """
        self._find(self._changing, at.world() if self._need_places else at.points[:, :3], at.time)
        acting = self.acting
        _push(at.points, at.velocities, acting.rows, acting.start, acting.forces, self._internal, at.h)
        for drag in self._drags:
            self._drag(*drag, at)

    def _find(self, loads: list[tuple[AppliedLoad, Rows, Forces]], x: NDArray[np.float64], time: float) -> None:
        """Set the forces of these loads, on their rows."""
        for load, rows, part in loads:
            self._total[rows] = 0.0
            load.add_forces(x, time, self._total)
            part[:] = self._total[rows]

    def _drag(self, load: DragLoad, rows: Rows, part: Forces, at: Substep) -> None:
        """The forces c (w - v') with the velocity v' after them: v' = (v + h c w / m) / (1 + h c / m)."""
        v = at.velocities
        c, w = load.coefficients(at.begun + at.origins, v, at.time)[rows, None], at.points[rows, 3:]
        part[:] = c * (load.value(at.time) - v[rows]) / (1.0 + at.h * c * w)
        v[rows] += at.h * w * part
        at.points[rows, :3] += at.h**2 * w * part

    def pull_springs(self, at: Substep) -> None:
        """Project the springs between points: C = l - l0 with compliance 1 / k, one after the other.

        Dlam = -C / (sum w c^2 + 1 / (k h^2)), with the coefficients c of the vertices. The direction is that of the
        beginning of the substep, see `ActuatorProjection`.
        """
        for spring, rows, part in self._springs:
            part[:], c = 0.0, spring.coefficients
            r = c @ at.world(rows) + spring.offset
            length = float(np.sqrt(r @ r))
            begun = c @ (at.begun[rows] + at.origins[rows]) + spring.offset
            if begun @ r > 0.0:
                r = begun * (length / np.sqrt(begun @ begun))
            w = at.points[rows, 3]
            if length > 0.0:
                stretch = length - spring.rest_length(at.time)
                pull = -stretch / (at.h**2 * float(w @ (c * c)) + 1.0 / spring.stiffness) / length * r
                part[:] = c[:, None] * pull
                moved = at.h**2 * w[:, None] * part
                at.points[rows, :3] += moved
                at.velocities[rows] += moved / at.h

    def pull_to_targets(self, at: Substep) -> None:
        """Project the springs to soft targets: C = x - target with compliance 1 / k, all three components at once.

        Dlam = -C / (w + 1 / (k h^2)), as for any XPBD constraint. These forces are external, so they act after the
        momentum restore.
        """
        for target, rows, part in self._targets:
            places = np.ascontiguousarray(target.targets(at.time))
            stiffness = np.broadcast_to(target.target.stiffness, 3).copy()
            _pull(at.points, at.velocities, at.origins, rows, places, stiffness, at.h, part)


@njit(cache=True)
def _push(points, velocities, rows, start, forces, internal, h):
    for f in range(len(internal)):
        for k in range(start[f], start[f + 1]):
            i = rows[k]
            for j in range(3):
                change = h * points[i, 3] * forces[k, j]
                points[i, j] += h * change
                if not internal[f]:
                    velocities[i, j] += change


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
