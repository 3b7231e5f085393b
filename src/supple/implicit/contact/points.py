"""The list of all contacts of a state."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.contact.potentials.barrier_energy import barrier_forces
from supple.contact.potentials.contacts import Contacts
from supple.contact.potentials.friction_lag import sides
from supple.implicit.contact.model import Barriers, ContactModel
from supple.state import ContactPoints


def contact_points(
    model: ContactModel, barriers: Barriers, x: NDArray[np.float64], between: Contacts, weight: float
) -> ContactPoints:
    """All contacts at x (n, 3), obstacles' vertices included.

    Parameters
    ----------
    between : of triangles
    weight : of the contact energies in the objective; forces are divided by it
    """
    mesh, planes = model.mesh, model.planes
    # Coefficients are positive on the first side. Points that a kind does not have have the coefficient 0.
    on_first = np.maximum(between.coefficients, 0.0)
    middles = np.einsum("ki,kij->kj", on_first, mesh.points.positions(x)[between.points]) - 0.5 * between.vectors
    normals = between.vectors / between.distances[:, None]
    sizes = barrier_forces(between, model.scales.dhat, barriers.triangles.stiffness)
    first, second = (mesh.owner[side] for side in sides(between))
    rows, heights, up, _ = planes.near(x)
    lowered = planes.positions(x)[planes.pairs[rows, 0]] - 0.5 * heights[:, None] * up
    pushes = barriers.planes.forces(x)
    return ContactPoints(
        points=np.concatenate([middles, lowered]),
        normals=np.concatenate([normals, up]),
        forces=np.concatenate([sizes[:, None] * normals, pushes[:, None] * up]) / weight,
        distances=np.concatenate([between.distances, heights]),
        first=np.concatenate([first, planes.owner[rows]]).astype(np.int32),
        second=np.concatenate([second, mesh.body_count + planes.obstacle[rows]]).astype(np.int32),
        names=mesh.names,
    )


def forces_on_owners(model: ContactModel, gradient: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    """Minus the gradient (n, 3) of a contact energy, summed over each body and obstacle: (3,) by name [N]."""
    bodies, obstacles = model.system.bodies, model.obstacles
    named = [(part.name, part.vertices) for part in bodies] + [(str(o.obstacle.name), o.vertices) for o in obstacles]
    return {name: -gradient[vertices].sum(axis=0) for name, vertices in named}
