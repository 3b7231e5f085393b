"""Cavities and cables, computed anew from a frame: their volumes and lengths, and their forces on the vertices."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.results.recording.actions.actuators import RecordedCable, RecordedCavity

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ActuatorState:
    """An actuator in one frame: a force Q that acts on a coordinate s, so that its work is Q ds.

    Attributes
    ----------
    work : the name of its work
    coordinate : volume of a cavity [m^3], length of a span [m]
    force : pressure [Pa], minus the tension [N]; NaN where it was not recorded
    vertices : (v,); gradient : (v, 3) of the coordinate, with a row for each
    """

    work: str
    coordinate: float
    force: float
    vertices: NDArray[np.int32]
    gradient: Floats

    def rate(self, velocities: Floats) -> float:
        """Of the coordinate, at velocities (n, 3) of all vertices [m/s]."""
        return float(np.einsum("ij,ij->", self.gradient, velocities[self.vertices]))


def actuator_states(
    cavities: tuple[RecordedCavity, ...],
    cables: tuple[RecordedCable, ...],
    pressures: Mapping[str, float],
    tensions: Mapping[str, float],
    x: Floats,
) -> list[ActuatorState]:
    """All cavities, then all spans of all cables, at positions x (n, 3) [m]."""
    states = [_cavity(each, pressures.get(each.name, np.nan), x) for each in cavities]
    for cable in cables:
        ends = cable.weights @ x[cable.vertices] + cable.offsets
        for k, r in enumerate(np.diff(ends, axis=0)):
            length = float(np.linalg.norm(r))
            along = r / length if length > 0.0 else np.zeros(3)
            gradient = (cable.weights[k + 1] - cable.weights[k])[:, None] * along
            tension = tensions.get(f"{cable.name}.{k}", np.nan)
            states.append(ActuatorState("cables", length, -tension, cable.vertices, gradient))
    return states


def _cavity(cavity: RecordedCavity, pressure: float, x: Floats) -> ActuatorState:
    """The volume is the sum of the tetrahedra between its triangles and their center, seen from inside."""
    corners = x[cavity.triangles]
    a, b, c = (corners - corners.mean(axis=(0, 1))).transpose(1, 0, 2)
    volume = -float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0
    on_corner = np.cross(b - a, c - a) / -6.0
    gradient = np.repeat(on_corner, 3, axis=0)
    return ActuatorState("cavities", volume, pressure, cavity.triangles.ravel(), gradient)
