"""What is computed from a frame of a simulation when it is read: strains and stresses, and forces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.kinds.suggestion import Named
from supple.model.pin_reactions import pin_labels
from supple.model.state import ContactPoints, SolverDetails
from supple.results.readings.by_body import ByBody
from supple.results.readings.driven import driven_readings
from supple.results.readings.reading import Reading
from supple.results.readings.sensor_readings import sensor_readings
from supple.results.readings.tet_readings import TetReadings


@dataclass(frozen=True, eq=False)
class JointReading:
    """A joint at the end of a step; of `XPBD`, forces are means over the step.

    Attributes
    ----------
    force : (3,) on its first body, that of its limits and its motor included [N]
    torque : (3,) about the joint's point, likewise [N m]
    coordinate : angle of a hinge [rad], travel of a slider [m], swing of a ball with a limit [rad]; otherwise None
    motor_force : effort of its motor, torque [N m] or force [N]; None without a motor
    violation : how far it is from holding, as a share of the diameter of gyration of its smaller body [-]
    """

    force: NDArray[np.float64]
    torque: NDArray[np.float64]
    coordinate: float | None
    motor_force: float | None
    violation: float


def joint_readings(details: SolverDetails) -> Mapping[str, JointReading]:
    """By name of the joint; empty where the solver has none."""
    found = {
        name: JointReading(
            force,
            details.joint_torques[name],
            details.joint_coordinates.get(name),
            details.motor_forces.get(name),
            details.joint_violations[name],
        )
        for name, force in details.joint_forces.items()
    }
    return Named("joint", found)


def contact_forces(contacts: ContactPoints | None, count: int) -> NDArray[np.float64]:
    """(count, 3) the force of all contacts on each vertex, friction included [N]; zero without contacts."""
    if contacts is None:
        return np.zeros((count, 3))
    return contacts.on_vertices(contacts.forces + contacts.friction, count)


def contact_pressures(
    contacts: ContactPoints | None, x: NDArray[np.float64], triangles: NDArray[np.int32]
) -> NDArray[np.float64]:
    """(n,) normal force per area at each vertex [Pa]; zero where nothing touches, where no triangle is pushed, and on
    rods.

    The area of a vertex is a third of its triangles, of those which the force pushes, projected along the force: at
    the edge of a block on a floor only the bottom counts.

    Parameters
    ----------
    x : (n, 3) positions [m]; triangles : (t, 3) the surfaces, counter-clockwise from outside
    """
    pressures = np.zeros(len(x))
    if contacts is None or not len(contacts):
        return pressures
    forces = contacts.on_vertices(contacts.forces, len(x))
    sizes = np.linalg.norm(forces, axis=1)
    a, b, c = x[triangles].transpose(1, 0, 2)
    thirds = np.cross(b - a, c - a) / 6.0
    areas = np.zeros(len(x))
    for corner in triangles.T:
        along = forces[corner] / np.where(sizes[corner] > 0.0, sizes[corner], 1.0)[:, None]
        areas += np.bincount(corner, np.maximum(-np.einsum("ti,ti->t", thirds, along), 0.0), len(x))
    pushed = areas > 0.0
    pressures[pushed] = sizes[pushed] / areas[pushed]
    return pressures


class FrameReadings(TetReadings):
    """Fields on tets (`TetReadings`), contact on surfaces, sensors, and reactions of pins."""

    report: Any

    @cached_property
    def contacts(self) -> ContactPoints | None:
        """All contacts, one by one, where they are known."""
        return None

    @cached_property
    def contact_force(self) -> ByBody:
        """Force of all contacts on each vertex, friction included: by body name, (n, 3) [N].

        Of a body that touches with its skin, those on the skin's vertices.
        """
        return self._by_vertex(contact_forces(self.contacts, len(self.system.points)))

    @cached_property
    def contact_pressure(self) -> ByBody:
        """Normal force of contacts per area at each vertex: by body name, (n,) [Pa]; 0 where nothing touches."""
        x = self.system.points.positions(self.state.positions)
        return self._by_vertex(contact_pressures(self.contacts, x, self.system.triangles))

    @cached_property
    def reactions(self) -> dict[str, NDArray[np.float64]]:
        """The force of each pin on its body by the pin's label, (3,) [N].

        Of `Implicit` those at the end of the step, of `XPBD` the means over it.

        Raises
        ------
        SceneError : where one is not known; see `SolverDetails.reaction_forces`.
        """
        known = self.report.details.reaction_forces
        for label in pin_labels(self.system):
            if label not in known:
                raise SceneError(
                    f"{label}: its force is not known: no step was taken, or XPBD was, and a body has rigid edges or "
                    "volumes; give EdgesAndVolume compliances above zero"
                )
        return dict(known)

    @cached_property
    def sensors(self) -> dict[str, Reading]:
        """By name, what the scene's sensors feel, such as `ForceReading`; then a `DrivenReading` of each obstacle and
        pin, a pin without a name being "BODY.pin"."""
        contacts = self.contacts if self.system.scene.sensors else None
        driven = driven_readings(self.system, self.state, self.report.details)
        return sensor_readings(self.system, self.state.positions, contacts) | driven

    def _by_vertex(self, values: NDArray[np.float64]) -> ByBody:
        return ByBody(values, {part.name: part.points for part in self.system.bodies}, {})
