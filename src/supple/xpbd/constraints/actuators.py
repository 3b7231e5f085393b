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

from supple.loads.actuators.actuator import Actuator
from supple.loads.actuators.cable_length import CableLength
from supple.loads.actuators.eyelets import angles, limits, span_forces
from supple.numerics.kernel_cache import njit
from supple.readings.actuator_readings import actuator_fields
from supple.readings.energy_balance import works_of_actuators
from supple.system import System
from supple.xpbd.assessment.substep import Substep

Floats = NDArray[np.float64]


class ActuatorProjection:
    """The actuators of a system in the substeps of one frame.

    For each actuator, arrays are of the parts of its coordinate (p,).
    """

    def __init__(self, system: System) -> None:
        self.system = system
        rigid = np.zeros(len(system.masses), dtype=np.bool_)
        for part in system.rigid_bodies:
            rigid[part.vertices] = True
        self._inner = [_is_inner(each, system.joined_components, rigid) for each in system.actuators]
        self._impulses, self._works, self._parts, self._forces = ([] for _ in range(4))

    def begin_frame(self, at: Substep) -> None:
        """Begin a frame, with the arrays of its beginning."""
        self._parts = [each.coordinate.parts(_own(each, at)) for each in self.system.actuators]
        self._impulses, self._works, self._forces = ([np.zeros_like(part) for part in self._parts] for _ in range(3))

    def project_within(self, at: Substep) -> None:
        """Move the vertices of the actuators within one piece, in place."""
        for k, each in enumerate(self.system.actuators):
            if self._inner[k]:
                self._project(k, each, at, _own(each, at))

    def project_between(self, at: Substep) -> None:
        """Move the vertices of all other actuators, in place, and change their velocities."""
        for k, each in enumerate(self.system.actuators):
            if not self._inner[k]:
                rows = each.coordinate.vertices
                before = at.points[rows, :3].copy()
                self._project(k, each, at, at.begun[rows] + at.origins[rows])
                at.velocities[rows] += (at.points[rows, :3] - before) / at.h

    def end_substep(self, at: Substep) -> None:
        """Add up impulses and works."""
        for k, each in enumerate(self.system.actuators):
            ended = each.coordinate.parts(_own(each, at))
            self._impulses[k] += at.h * self._forces[k]
            self._works[k] += self._forces[k] * (ended - self._parts[k])
            self._parts[k] = ended

    def fields(self, duration: float) -> Mapping[str, Any]:
        """What the details of a frame of this duration [s] have, with the mean forces."""
        means = [impulse / duration for impulse in self._impulses]
        return actuator_fields(self.system, means, self._parts, self._works)

    def works(self) -> dict[str, float]:
        """Those of the frame so far, by name [J]."""
        return works_of_actuators(self.system, self._works)

    def acting(self, at: Substep) -> Floats:
        """(n, 3) the forces of the substep on all vertices, at their places at its end [N]."""
        out = np.zeros_like(at.velocities)
        for forces, each in zip(self._forces, self.system.actuators, strict=True):
            gradients = each.coordinate.part_gradients(_own(each, at))
            out[each.coordinate.vertices] += np.einsum("p,pij->ij", forces, gradients)
        return out

    def _project(self, k: int, each: Actuator, at: Substep, places: Floats) -> None:
        """Move the vertices of an actuator, in place, along the gradients at `places` (v, 3) of them."""
        rows, own = each.coordinate.vertices, _own(each, at)
        gradients, parts = each.coordinate.part_gradients(places), each.coordinate.parts(own)
        grips = np.zeros(len(parts) - 1)
        self._forces[k][:] = 0.0
        total = gradients[0] if len(gradients) == 1 else gradients.sum(axis=0)
        moved = at.h**2 * at.points[rows, 3, None] * total
        mobility = float(np.einsum("ij,ij->", moved, total))
        if mobility <= 0.0:
            return
        force = each.law.reached(at.time, float(parts.sum()), mobility)
        moved *= force
        if each.friction > 0.0 and isinstance(each.coordinate, CableLength):
            turns = angles(each.coordinate.spans(own)[1])
            free = at.points[rows, 3] * at.h**2
            _stop_slips(gradients, free, parts - self._parts[k], turns, each.friction, -force, moved, grips)
        _move(at.points, rows, moved)
        self._forces[k] = span_forces(force, grips)


@njit(cache=True)
def _move(points, rows, moved):
    """Add displacements (v, 3) to those rows (v,) of points (n, 4)."""
    for k in range(len(rows)):
        for j in range(3):
            points[rows[k], j] += moved[k, j]


@njit(cache=True, error_model="numpy")
def _stop_slips(gradients, free, longer, turns, friction, tension, moved, grips):
    """Friction at the eyelets of a cable, one after the other from the winch, with lengths linear in `moved`.

    Parameters
    ----------
    gradients : (s, v, 3) of the lengths; free : (v,) inverse masses times h^2; longer : (s,) changes of the lengths
        without the cable [m]; turns : (s - 1,) [rad]; tension : at the winch [N]
    moved : (v, 3) by the tension [m], to which the motion by friction is added; grips : (s - 1,) f [N], set here
    """
    before = np.empty_like(moved)
    for e in range(len(grips) - 1, -1, -1):
        slip = mobility = 0.0
        for i in range(len(free)):
            for j in range(3):
                before[i, j] = 0.0
                for k in range(e + 1):
                    before[i, j] += gradients[k, i, j]
                slip -= before[i, j] * moved[i, j]
                mobility += free[i] * before[i, j] ** 2
        for k in range(e + 1):
            slip -= longer[k]
        if mobility > 0.0:
            towards, away = limits(tension, turns[e], friction)
            grips[e] = min(max(slip / mobility, -away), towards)
            for i in range(len(free)):
                for j in range(3):
                    moved[i, j] += grips[e] * free[i] * before[i, j]
        tension -= grips[e]


def _is_inner(each: Actuator, pieces: NDArray[np.int32], rigid: NDArray[np.bool_]) -> bool:
    rows = each.coordinate.vertices
    return len(np.unique(pieces[rows])) == 1 and not each.coordinate.is_anchored and not rigid[rows].any()


def _own(each: Actuator, at: Substep) -> Floats:
    return at.world(each.coordinate.vertices)
