"""Projection of actuators: one row over all of their vertices.

Without its generalized force Q the coordinate would be s. Q moves the vertices by h^2 w Q ds/dx and, to first order,
the coordinate by h^2 Q sum w |ds/dx|^2. The law gives the Q that fits the coordinate which it leads to. Friction at an
eyelet of a cable then stops its slip, with a force that is at most that of the capstan's law.

An actuator between vertices of one piece, without points of rigid bodies, is projected with the constraints, before
the momentum of the piece is restored; one that joins pieces to each other or to the world, or pulls at a rigid body,
after that. The latter moves vertices along ds/dx of the beginning of the substep: as the velocity is (x - x_n) / h,
such forces have no moment (Ryckaert, Ciccotti, Berendsen, "Numerical integration of the cartesian equations of motion
of a system with constraints", 1977).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.model.actuator_readings import actuator_fields
from supple.model.energy_balance import works_of_actuators
from supple.model.loads.actuators.actuator import Actuator
from supple.model.loads.actuators.cables import CableLength, limits, turn_at
from supple.model.loads.actuators.laws import GivenValue
from supple.model.system import System
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.moment import Substep

Floats = NDArray[np.float64]


class ActuatorProjection:
    """The actuators of a system in the substeps of one frame.

    Attributes
    ----------
    within, between : whether there are any within one piece, and others
    """

    def __init__(self, system: System) -> None:
        self.system = system
        rigid = np.zeros(len(system.masses), dtype=np.bool_)
        for part in system.rigid_bodies:
            rigid[part.vertices] = True
        self._all = [_Projected(each) for each in system.actuators]
        inner = [_is_inner(each, system.joined_components, rigid) for each in system.actuators]
        self._within = [each for each, is_inner in zip(self._all, inner, strict=True) if is_inner]
        self.within, self.between = any(inner), not all(inner)
        self._between = [each for each, is_inner in zip(self._all, inner, strict=True) if not is_inner]

    def begin_frame(self, at: Substep) -> None:
        """Begin a frame, with the arrays of its beginning."""
        for each in self._all:
            each.begin_frame(at)

    def project_within(self, at: Substep) -> None:
        """Move the vertices of the actuators within one piece, in place."""
        for each in self._within:
            each.project(at)

    def project_between(self, at: Substep) -> None:
        """Move the vertices of all other actuators, in place, and change their velocities."""
        for each in self._between:
            rows = each.coordinate.vertices
            before = at.points[rows, :3].copy()
            each.project(at, at.begun[rows] + at.origins[rows])
            at.velocities[rows] += (at.points[rows, :3] - before) / at.h

    def end_substep(self, at: Substep) -> None:
        """Add up impulses and works."""
        for each in self._all:
            each.end_substep(at)

    def fields(self, duration: float) -> Mapping[str, Any]:
        """What the details of a frame of this duration [s] have, with the mean forces."""
        means = [each.impulses / duration for each in self._all]
        return actuator_fields(self.system, means, [each.begun for each in self._all], self._works())

    def works(self) -> dict[str, float]:
        """Those of the frame so far, by name [J]."""
        return works_of_actuators(self.system, self._works())

    def add_forces(self, at: Substep, out: Floats) -> None:
        """Add the forces of the substep on all vertices to `out` (n, 3) [N]."""
        for each in self._all:
            out[each.coordinate.vertices] += np.einsum("p,pij->ij", each.forces, each.gradients)

    def _works(self) -> list[Floats]:
        return [each.works for each in self._all]


class _Projected:
    """An actuator with arrays of the parts of its coordinate (p,).

    Attributes
    ----------
    begun : parts where the substep began; forces : of the substep; impulses, works : of the frame
    gradients : (p, v, 3) of the parts along which the forces of the substep act
    """

    def __init__(self, actuator: Actuator) -> None:
        self.actuator, self.coordinate = actuator, actuator.coordinate
        p, v = self.coordinate.count, len(self.coordinate.vertices)
        self.begun, self.forces, self.impulses, self.works, self._parts = np.zeros((5, p))
        self._own, self._total, self._moved = np.zeros((3, v, 3))
        self.gradients = np.zeros((p, v, 3))

    def begin_frame(self, at: Substep) -> None:
        self._place(at)
        self.begun[:] = self._parts
        self.forces[:] = self.impulses[:] = self.works[:] = 0.0

    def project(self, at: Substep, places: Floats | None = None) -> None:
        """Move the vertices, in place, along the gradients at `places` (v, 3) of them, otherwise at their own."""
        rows, h2 = self.coordinate.vertices, at.h**2
        self._place(at)
        if places is not None:
            self.coordinate.differentiate(places, np.empty_like(self._parts), self.gradients)
        mobility, s = _mobility(at.points, rows, h2, self._parts, self.gradients, self._total, self._moved)
        self.forces[:] = 0.0
        if mobility <= 0.0 and isinstance(self.actuator.law, GivenValue):  # no force is enough
            return
        force = self.actuator.law.reached(at.time, s, mobility)
        self.forces[:] = force
        self._moved *= force
        if self.actuator.friction > 0.0 and isinstance(self.coordinate, CableLength):
            spans = (*self.coordinate.spans(self._own), self.begun, self.gradients)
            _stop_slips(at.points, rows, h2, spans, self.actuator.friction, self._total, self._moved, self.forces)
        _move(at.points, rows, self._moved)

    def end_substep(self, at: Substep) -> None:
        _gather(at.points, at.origins, self.coordinate.vertices, self._own)
        self.coordinate.measure(self._own, self._parts)
        _add_works(self.forces, self._parts, at.h, self.begun, self.impulses, self.works)

    def _place(self, at: Substep) -> None:
        """Set what depends on the positions."""
        _gather(at.points, at.origins, self.coordinate.vertices, self._own)
        self.coordinate.differentiate(self._own, self._parts, self.gradients)


@njit(cache=True)
def _gather(points, origins, rows, out):
    """The positions (v, 3) of those rows (v,) in the world."""
    for k in range(len(rows)):
        for j in range(3):
            out[k, j] = points[rows[k], j] + origins[rows[k], j]


@njit(cache=True)
def _mobility(points, rows, h2, parts, gradients, total, moved):
    """Set total <- ds/dx and moved <- h^2 w ds/dx (v, 3); returns their product, and s."""
    product = s = 0.0
    for part in parts:
        s += part
    for i in range(len(rows)):
        for j in range(3):
            total[i, j] = 0.0
            for p in range(len(parts)):
                total[i, j] += gradients[p, i, j]
            moved[i, j] = h2 * points[rows[i], 3] * total[i, j]
            product += moved[i, j] * total[i, j]
    return product, s


@njit(cache=True)
def _move(points, rows, moved):
    """Add displacements (v, 3) to those rows (v,) of points (n, 4)."""
    for k in range(len(rows)):
        for j in range(3):
            points[rows[k], j] += moved[k, j]


@njit(cache=True)
def _add_works(forces, parts, h, begun, impulses, works):
    """Add up impulses and works of a substep, and begin the next one."""
    for p in range(len(parts)):
        impulses[p] += h * forces[p]
        works[p] += forces[p] * (parts[p] - begun[p])
        begun[p] = parts[p]


@njit(cache=True)
def _stop_slips(points, rows, h2, spans, friction, before, moved, forces):
    """Friction at the eyelets of a cable, one after the other from the winch, with lengths linear in `moved`.

    Parameters
    ----------
    spans : lengths (s,) and directions (s, 3) without the cable, lengths (s,) where the substep began [m], and
        gradients (s, v, 3)
    before : (v, 3) scratch memory; moved : by the tension [m], to which the motion by friction is added
    forces : (s,) that of the whole cable, to which those of the eyelets are added, f (s - 1,) of each [N]
    """
    lengths, directions, begun, gradients = spans
    tension, grips = -forces[-1], 0.0
    for e in range(len(lengths) - 2, -1, -1):
        slip = mobility = 0.0
        for i in range(len(rows)):
            for j in range(3):
                before[i, j] = 0.0
                for k in range(e + 1):
                    before[i, j] += gradients[k, i, j]
                slip -= before[i, j] * moved[i, j]
                mobility += h2 * points[rows[i], 3] * before[i, j] ** 2
        for k in range(e + 1):
            slip -= lengths[k] - begun[k]
        if mobility > 0.0:
            towards, away = limits(tension, turn_at(directions, e), friction)
            grip = min(max(slip / mobility, -away), towards)
            for i in range(len(rows)):
                for j in range(3):
                    moved[i, j] += grip * h2 * points[rows[i], 3] * before[i, j]
            tension -= grip
            grips += grip
        forces[e] += grips


def _is_inner(each: Actuator, pieces: NDArray[np.int32], rigid: NDArray[np.bool_]) -> bool:
    rows = each.coordinate.vertices
    return len(np.unique(pieces[rows])) == 1 and not each.coordinate.is_anchored and not rigid[rows].any()
