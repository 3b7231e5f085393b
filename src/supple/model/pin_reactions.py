"""Reactions of pins, from the balance of forces on the pinned vertices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.model.actuator_readings import add_actuator_forces
from supple.model.state import ContactPoints, SolverDetails
from supple.model.system import System


def pin_labels(system: System) -> list[str]:
    """The label of every pin; repeated labels get a number."""
    labels: list[str] = []
    for pin in system.pins:
        label, number = pin.label, 2
        while label in labels:
            label = f"{pin.label} #{number}"
            number += 1
        labels.append(label)
    return labels


def balanced_reactions(
    system: System,
    x: NDArray[np.float64],
    time: float,
    P: NDArray[np.float64],
    contacts: ContactPoints | None,
    details: SolverDetails,
) -> dict[str, NDArray[np.float64]]:
    """By label, minus the sum (3,) of all other forces on the pinned vertices and those welded to them [N].

    Other forces: elastic ones, weight, loads, actuators and contact. Viscous forces and the inertia of the pinned
    vertices themselves are left out.

    Parameters
    ----------
    x : (n, 3) positions [m]; time : [s]; P : (m, 3, 3) first Piola stress of all tets [Pa]
    details : of the solver, with the forces of actuators

    Raises
    ------
    SceneError : where a pinned vertex is stitched: the force of the stitch is not known.
    """
    forces = system.masses[:, None] * system.gravity
    for load in system.loads:
        if not load.is_internal:  # those are in the stress
            load.add_forces(x, time, forces)
    add_actuator_forces(system, details, x, forces)
    if contacts is not None:
        on_points = contacts.on_vertices(contacts.forces + contacts.friction, len(system.points))
        system.points.add_forces(on_points, forces)
    welding, stitched = system.welding, system.stitching.nodes()
    moved_with = [welding.vertices[np.isin(welding.control[:, 0], pin.vertices)] for pin in system.pins]
    _add_elastic_forces(system, P, np.concatenate([system.pinned_vertices, *moved_with]), forces)
    found = {}
    for label, pin, more in zip(pin_labels(system), system.pins, moved_with, strict=True):
        rows = np.concatenate([pin.vertices, more])
        if np.isin(rows, stitched).any():
            raise SceneError(f"{label}: a vertex of it is stitched, so that XPBD has no reaction of it; use Implicit")
        found[label] = -forces[rows].sum(axis=0)
    return found


def _add_elastic_forces(
    system: System, P: NDArray[np.float64], vertices: NDArray[np.integer], out: NDArray[np.float64]
) -> None:
    """Add -V P Dm^-T of the soft tets that have one of these vertices to their vertices' rows of `out` (n, 3)."""
    held = np.zeros(len(out), dtype=bool)
    held[vertices] = True
    for part in system.rigid_bodies:
        held[part.vertices] = False
    rows = np.flatnonzero(held[system.tets].any(axis=1))
    tets, inverse = system.tets[rows], system.rest_shape_inverse[rows]
    forces = -system.rest_volumes[rows, None, None] * P[rows] @ np.swapaxes(inverse, 1, 2)
    for k in range(3):
        np.add.at(out, tets[:, k + 1], forces[:, :, k])
        np.add.at(out, tets[:, 0], -forces[:, :, k])
