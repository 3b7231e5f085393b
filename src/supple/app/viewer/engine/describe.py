"""Describes a live scene for the page: its description, measures of a snapshot, and what sensors and actuators read."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.app.viewer.engine.scene.live_scene import LiveScene
from supple.app.viewer.engine.scene.solvers import kind_of, solver_values
from supple.app.viewer.protocol import limits
from supple.app.viewer.protocol.parameters import PARAMETERS, Value
from supple.app.viewer.protocol.snapshots import BodyDescription, Measures, Reading, SceneDescription
from supple.materials.own.energy_material import EnergyMaterial
from supple.model.actuator_readings import cable_readings, cavity_readings
from supple.model.diagnostics import measure
from supple.model.system import BodyRange
from supple.results.readings.frame_readings import joint_readings
from supple.results.readings.sensor_readings import sensor_readings
from supple.scene.joints.placed import placed_joints
from supple.scene.stitches.measures import StitchEnds
from supple.solvers.xpbd.details import XPBDDetails


def describe(live: LiveScene) -> SceneDescription:
    """All properties of the scene that do not change from frame to frame."""
    system, setup = live.system, live.setup
    gravity = -float(np.asarray(setup.scene.gravity) @ live.up)
    positions = system.points.positions(live.state.positions)
    return SceneDescription(
        revision=live.revision,
        bodies=tuple(_body(part) for part in system.bodies),
        obstacles=tuple(replace(obstacle, motion=None) for obstacle in system.obstacles),
        solver=kind_of(setup.solver),
        values={**solver_values(setup.solver), "dt": setup.dt, "gravity": gravity},
        up=live.up,
        low=positions.min(axis=0),
        high=positions.max(axis=0),
        stitches=StitchEnds.of(system.scene.stitching, system.scene.bodies),
        n_tets=len(system.tets),
        joints=placed_joints(system.scene.bodies, system.scene.joints, system.obstacles),
    )


def _body(part: BodyRange) -> BodyDescription:
    body = part.body
    values = {"friction": body.friction, **({} if part.rigid else _material_values(body.material))}
    if isinstance(body.material, EnergyMaterial):  # what is compiled stays here
        body = body.changed(material=body.material.recorded())
    _ = body.attached_skin  # found once, and sent with the body
    return BodyDescription(body, part.number, part.vertices, part.tets, values)


def _material_values(material: Any) -> dict[str, Value]:
    """The parameters of the material that a page can change: those that are one number."""
    values: dict[str, Value] = {}
    for field in fields(material):
        value = getattr(material, field.name)
        if field.name in PARAMETERS and np.ndim(value) == 0:
            values[field.name] = float(value)
    return values


def measures(live: LiveScene) -> Measures:
    """The numbers of the current state, and of the last step."""
    report, details = live.report, live.report.details
    return Measures(
        **vars(measure(live.system, live.state)),
        status=str(report.status),
        message=report.message,
        contacts=details.contacts,
        min_distance=details.smallest_gap if isinstance(details, XPBDDetails) else report.min_distance,
        iterations=int(report.iterations),
        joints=joint_readings(details),
    )


def readings(live: LiveScene) -> tuple[Reading, ...]:
    """The number of each sensor, the pressure of each cavity, and the largest tension of each cable."""
    report, system = live.report, live.system
    found = []
    if system.scene.sensors:
        contacts = None if report.contacts is None else report.contacts()
        for name, reading in sensor_readings(system, live.state.positions, contacts).items():
            found.append(Reading(name, reading.unit, reading.value))
    for name, cavity in cavity_readings(report.details).items():
        found.append(Reading(name, "Pa", cavity.pressure))
    for name, cable in cable_readings(report.details).items():
        found.append(Reading(name, "N", max(cable.tension, default=0.0)))
    return tuple(found)


def contact_points(live: LiveScene) -> NDArray[np.float64]:
    """(c, 3) points [m] of the contacts of the last step; at most `MOST_CONTACT_POINTS`."""
    points = np.zeros((0, 3)) if live.report.contacts is None else live.report.contacts().points
    return np.ascontiguousarray(points[:: max(1, -(-len(points) // limits.MOST_CONTACT_POINTS))])


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
