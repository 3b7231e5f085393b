"""What sensors, cavities and cables read, and the forces of contacts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.app.viewer.engine.scene.live_scene import LiveScene
from supple.app.viewer.protocol import limits
from supple.app.viewer.protocol.snapshots import Reading
from supple.model.actuator_readings import cable_readings, cavity_readings
from supple.results.readings.sensor_readings import sensor_readings


def readings(live: LiveScene) -> tuple[Reading, ...]:
    """The normal force of each sensor, the pressure of each cavity, and the largest tension of each cable."""
    report, system = live.report, live.system
    found = []
    if system.scene.sensors:
        contacts = None if report.contacts is None else report.contacts()
        for name, reading in sensor_readings(system, live.state.positions, contacts).items():
            found.append(Reading(name, "N", float(np.sum(reading.normal))))
    for name, cavity in cavity_readings(report.details).items():
        found.append(Reading(name, "Pa", cavity.pressure))
    for name, cable in cable_readings(report.details).items():
        found.append(Reading(name, "N", max(cable.tension, default=0.0)))
    return tuple(found)


def strongest_forces(live: LiveScene) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Points (c, 3) [m] and forces (c, 3) [N], friction included, of the strongest contacts of the last step.

    None where the solver does not know them.
    """
    if live.report.contacts is None:
        return None
    contacts = live.report.contacts()
    forces = contacts.forces + contacts.friction
    strongest = np.argsort(-np.linalg.norm(forces, axis=1), kind="stable")[: limits.MOST_CONTACT_FORCES]
    return contacts.points[strongest], forces[strongest]
