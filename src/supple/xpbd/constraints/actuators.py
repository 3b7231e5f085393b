"""Projection of actuators: one row over all of their vertices.

Without its generalized force Q the coordinate would be s. Q moves the vertices by h^2 w Q ds/dx and, to first order,
the coordinate by h^2 Q sum w |ds/dx|^2. The law gives the Q that fits the coordinate which it leads to.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.loads.actuators.actuator import Actuator
from supple.readings.actuator_readings import actuator_fields
from supple.system import System


class ActuatorProjection:
    """The actuators of a system in the substeps of one frame.

    Attributes
    ----------
    impulses : (a,) Q times the length of the substep, summed over the frame
    works : (a,) Q times the change of the coordinate, likewise [J]
    values : (a,) the coordinates at the end of the last substep
    """

    def __init__(self, system: System) -> None:
        self.actuators = system.actuators
        self.impulses, self.works, self.values = (np.zeros(len(system.actuators)) for _ in range(3))
        self._forces = np.zeros(len(system.actuators))

    def begin_frame(self, points: NDArray[np.float64], origins: NDArray[np.float64]) -> None:
        """Begin a frame at points (n, 4) about origins (n, 3) [m]."""
        self.impulses[:] = self.works[:] = 0.0
        self.values[:] = [each.coordinate.value(_own(each, points, origins)) for each in self.actuators]

    def project(self, points: NDArray[np.float64], origins: NDArray[np.float64], time: float, h: float) -> None:
        """Move the vertices, in place, in a substep of h [s] to `time` [s]; points (n, 4) about origins (n, 3) [m]."""
        for k, each in enumerate(self.actuators):
            rows, own = each.coordinate.vertices, _own(each, points, origins)
            gradient = each.coordinate.gradient(own)
            moved = h * h * points[rows, 3, None] * gradient
            mobility = float(np.einsum("ij,ij->", moved, gradient))
            if mobility > 0.0:
                self._forces[k] = each.law.reached(time, each.coordinate.value(own), mobility)
                points[rows, :3] += self._forces[k] * moved

    def end_substep(self, points: NDArray[np.float64], origins: NDArray[np.float64], h: float) -> float:
        """The work on the bodies in a substep of h [s] [J]."""
        if not self.actuators:
            return 0.0
        ended = np.array([each.coordinate.value(_own(each, points, origins)) for each in self.actuators])
        works = self._forces * (ended - self.values)
        self.impulses += h * self._forces
        self.works += works
        self.values = ended
        return float(works.sum())

    def fields(self, duration: float) -> Mapping[str, Any]:
        """What the details of a frame of this duration [s] have, with the mean forces."""
        return actuator_fields(self.actuators, self.impulses / duration, self.values, self.works)


def _own(each: Actuator, points: NDArray[np.float64], origins: NDArray[np.float64]) -> NDArray[np.float64]:
    rows = each.coordinate.vertices
    return points[rows, :3] + origins[rows]
