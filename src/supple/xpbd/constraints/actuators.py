"""Projection of actuators: one row over all of their vertices.

Without its generalized force Q the coordinate would be s. Q moves the vertices by h^2 w Q ds/dx and, to first order,
the coordinate by h^2 Q sum w |ds/dx|^2. The law gives the Q that fits the coordinate which it leads to. Friction at an
eyelet of a cable then stops its slip, with a force that is at most that of the capstan's law.

An actuator between vertices of one piece is projected with the constraints, before the momentum of the piece is
restored; one that joins pieces to each other or to the world, after that.
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
from supple.system import System

Floats = NDArray[np.float64]


class ActuatorProjection:
    """The actuators of a system in the substeps of one frame.

    Points are (n, 4) about origins (n, 3) [m], times of ends of substeps in [s], h is their length [s]. For each
    actuator, arrays are of the parts of its coordinate (p,).
    """

    def __init__(self, system: System) -> None:
        self.system = system
        pieces = [np.unique(system.joined_components[each.coordinate.vertices]) for each in system.actuators]
        self._inner = [
            len(piece) == 1 and not each.coordinate.is_anchored
            for piece, each in zip(pieces, system.actuators, strict=True)
        ]
        self._impulses, self._works, self._parts, self._forces = ([] for _ in range(4))

    def begin_frame(self, points: Floats, origins: Floats) -> None:
        """Begin a frame."""
        self._parts = [each.coordinate.parts(_own(each, points, origins)) for each in self.system.actuators]
        self._impulses, self._works, self._forces = ([np.zeros_like(part) for part in self._parts] for _ in range(3))

    def project_within(self, points: Floats, origins: Floats, time: float, h: float) -> None:
        """Move the vertices of the actuators within one piece, in place."""
        for k, each in enumerate(self.system.actuators):
            if self._inner[k]:
                self._project(k, each, points, origins, time, h)

    def project_between(self, points: Floats, velocities: Floats, origins: Floats, time: float, h: float) -> None:
        """Move the vertices of all other actuators, in place, and change their velocities (n, 3) [m/s]."""
        for k, each in enumerate(self.system.actuators):
            if not self._inner[k]:
                rows = each.coordinate.vertices
                before = points[rows, :3].copy()
                self._project(k, each, points, origins, time, h)
                velocities[rows] += (points[rows, :3] - before) / h

    def end_substep(self, points: Floats, origins: Floats, h: float) -> float:
        """The work on the bodies in a substep [J]."""
        total = 0.0
        for k, each in enumerate(self.system.actuators):
            ended = each.coordinate.parts(_own(each, points, origins))
            work = self._forces[k] * (ended - self._parts[k])
            self._impulses[k] += h * self._forces[k]
            self._works[k] += work
            self._parts[k] = ended
            total += float(work.sum())
        return total

    def fields(self, duration: float) -> Mapping[str, Any]:
        """What the details of a frame of this duration [s] have, with the mean forces."""
        means = [impulse / duration for impulse in self._impulses]
        return actuator_fields(self.system, means, self._parts, self._works)

    def _project(self, k: int, each: Actuator, points: Floats, origins: Floats, time: float, h: float) -> None:
        rows, own = each.coordinate.vertices, _own(each, points, origins)
        gradients, parts = each.coordinate.part_gradients(own), each.coordinate.parts(own)
        grips = np.zeros(len(parts) - 1)
        self._forces[k][:] = 0.0
        total = gradients.sum(axis=0)
        moved = h * h * points[rows, 3, None] * total
        mobility = float(np.einsum("ij,ij->", moved, total))
        if mobility <= 0.0:
            return
        force = each.law.reached(time, float(parts.sum()), mobility)
        moved *= force
        if each.friction > 0.0 and isinstance(each.coordinate, CableLength):
            turns = angles(each.coordinate.spans(own)[1])
            free = points[rows, 3] * h * h
            _stop_slips(gradients, free, parts - self._parts[k], turns, each.friction, -force, moved, grips)
        points[rows, :3] += moved
        self._forces[k] = span_forces(force, grips)


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


def _own(each: Actuator, points: Floats, origins: Floats) -> Floats:
    rows = each.coordinate.vertices
    return points[rows, :3] + origins[rows]
