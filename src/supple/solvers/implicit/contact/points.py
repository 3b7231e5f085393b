"""The list of all contacts of a state."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from supple.contact.barrier.barrier_energy import barrier_forces
from supple.contact.barrier.friction_energy import sides, slip_forces
from supple.contact.features.contacts import Contacts
from supple.contact.features.pair_geometry import EDGE_EDGE
from supple.model.state import ContactPoints
from supple.solvers.implicit.contact.collisions import Barrier
from supple.solvers.implicit.contact.friction import Friction
from supple.solvers.implicit.contact.model import ContactModel


def contact_points(
    model: ContactModel,
    barrier: Barrier,
    frictions: Sequence[Friction],
    x: NDArray[np.float64],
    contacts: Contacts,
    weight: float,
) -> ContactPoints:
    """All contacts at x (n, 3), obstacles' vertices included.

    Friction acts between the parts that were in contact when its normal forces were updated last. Two that have left
    the range of the barrier since then are a contact of their own, with a normal force of zero.

    Parameters
    ----------
    contacts : at x
    weight : of the contact energies in the objective; forces are divided by it
    """
    mesh, collisions = model.mesh, model.collisions
    place = collisions.half_spaces.points.positions(x)
    kinds, points, coefficients, vectors, distances, _, _ = contacts
    normals = vectors / distances[:, None]
    forces = barrier_forces(contacts, collisions.dhat, barrier.stiffness, barrier.soft)[:, None] * normals
    friction = np.zeros_like(forces)
    for term in frictions:
        slips, pulls = term.slips, slip_forces(term.points.positions(x), term.slips, term.reach)
        same = _rows_of(np.column_stack([slips.kinds, slips.points]), np.column_stack([kinds, points]))
        np.add.at(friction, same[same >= 0], pulls[same >= 0])
        left = same < 0
        points = np.concatenate([points, slips.points[left]])
        kinds = np.concatenate([kinds, slips.kinds[left]])
        coefficients = np.concatenate([coefficients, slips.coefficients[left]])
        normals = np.concatenate([normals, slips.normals[left]])
        between_sides = np.einsum("ki,kij->kj", slips.coefficients[left], place[slips.points[left]])
        distances = np.concatenate([distances, np.einsum("kj,kj->k", between_sides, slips.normals[left])])
        forces = np.concatenate([forces, np.zeros_like(pulls[left])])
        friction = np.concatenate([friction, pulls[left]])
    # Points that a kind does not have have the coefficient 0.
    on_first = np.where((np.arange(4) == 0) | ((np.arange(4) == 1) & (kinds == EDGE_EDGE)[:, None]), coefficients, 0.0)
    middles = np.einsum("ki,kij->kj", on_first, place[points]) - 0.5 * distances[:, None] * normals
    first, second = (collisions.half_spaces.owner[side] for side in sides(kinds, points))
    contact, slot = np.nonzero(coefficients)
    point = points[contact, slot]
    of_bodies = np.append(mesh.rows, -1)[np.minimum(point, len(mesh.rows))]
    own = of_bodies >= 0
    return ContactPoints(
        points=middles,
        normals=normals,
        forces=forces / weight,
        friction=friction / weight,
        distances=distances,
        first=first,
        second=second,
        names=mesh.names,
        rows=contact[own],
        vertices=of_bodies[own],
        weights=coefficients[contact, slot][own],
    )


def _rows_of(rows: NDArray[np.integer], among: NDArray[np.integer]) -> NDArray[np.int64]:
    """For each of `rows` (k, c), the first of the rows `among` (m, c) that is equal; -1 where none exists."""
    _, number = np.unique(np.concatenate([among, rows]), axis=0, return_inverse=True)
    number = number.ravel()
    place = np.full(len(number), -1)
    place[number[: len(among)][::-1]] = np.arange(len(among))[::-1]
    return place[number[len(among) :]]


def forces_on_owners(model: ContactModel, gradient: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    """Minus the gradient (n, 3) of a contact energy, summed over each body and obstacle: (3,) by name [N]."""
    bodies, obstacles = model.system.bodies, model.obstacles
    named = [(part.name, part.vertices) for part in bodies] + [(str(o.obstacle.name), o.vertices) for o in obstacles]
    return {name: -gradient[vertices].sum(axis=0) for name, vertices in named}
