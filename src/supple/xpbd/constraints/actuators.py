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
        own = _own(each, points, origins)
        gradients = each.coordinate.part_gradients(own)
        total = gradients.sum(axis=0)
        mobility = self._mobility(each, points, total, h)
        self._forces[k][:] = 0.0
        if mobility <= 0.0:
            return
        force = each.law.reached(time, each.coordinate.value(own), mobility)
        self._move(each, points, force * total, h)
        grips = np.zeros(len(gradients) - 1)
        if each.friction > 0.0 and isinstance(each.coordinate, CableLength):
            tension = -force
            turns = angles(each.coordinate.spans(own)[1])
            for e in reversed(range(len(grips))):
                before = gradients[: e + 1].sum(axis=0)
                mobility = self._mobility(each, points, before, h)
                if mobility > 0.0:
                    now = each.coordinate.parts(_own(each, points, origins))
                    slip = float((self._parts[k] - now)[: e + 1].sum())
                    towards, away = limits(tension, float(turns[e]), each.friction)
                    grips[e] = min(max(slip / mobility, -away), towards)
                    self._move(each, points, grips[e] * before, h)
                tension -= grips[e]
        self._forces[k] = span_forces(force, grips)

    @staticmethod
    def _mobility(each: Actuator, points: Floats, gradient: Floats, h: float) -> float:
        return h * h * float(np.einsum("i,ij,ij->", points[each.coordinate.vertices, 3], gradient, gradient))

    @staticmethod
    def _move(each: Actuator, points: Floats, forces: Floats, h: float) -> None:
        rows = each.coordinate.vertices
        points[rows, :3] += h * h * points[rows, 3, None] * forces


def _own(each: Actuator, points: Floats, origins: Floats) -> Floats:
    rows = each.coordinate.vertices
    return points[rows, :3] + origins[rows]
