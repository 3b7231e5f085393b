"""The list of all contacts of a state."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.implicit.contact.half_spaces import barrier_terms
from supple.implicit.contact.model import Barriers, ContactModel
from supple.implicit.contact.threads import one_contact_thread
from supple.state import ContactPoints


@one_contact_thread()
def contact_points(model: ContactModel, barriers: Barriers, x: NDArray[np.float64], weight: float) -> ContactPoints:
    """All contacts at x (n, 3), obstacles' vertices included.

    Parameters
    ----------
    weight : of the contact energies in the objective; forces are divided by it
    """
    surface, collisions = model.surface, model.collisions
    mesh, points = surface.mesh, collisions.points(x)
    found = collisions.at(x)
    edges, faces = mesh.edges, mesh.faces
    rows: list[tuple[NDArray, NDArray, NDArray, float, int, int]] = []
    for k in range(len(found)):
        contact = found[k]
        ids = [v for v in contact.vertex_ids(edges, faces) if v >= 0]
        stencil = points[ids]
        flat = stencil.ravel()
        gap, coefficients = contact.compute_distance_vector_with_coefficients(flat)
        coefficients = np.asarray(coefficients)
        distance = float(np.linalg.norm(gap))
        gradient = barriers.triangles.potential.gradient(contact, flat).reshape(-1, 3) / weight
        # Coefficients are positive on the first primitive and negative on the second; an end of an edge that is not the
        # nearest point has zero, of either sign.
        one = np.arange(len(ids)) < (2 if found.is_edge_edge(k) else 1)
        near_first = coefficients[one] @ stencil[one]
        near_second = -coefficients[~one] @ stencil[~one]
        first, second = (int(surface.owner[np.asarray(ids)[side][0]]) for side in (one, ~one))
        normal = (near_first - near_second) / distance
        rows.append((0.5 * (near_first + near_second), normal, -gradient[one].sum(axis=0), distance, first, second))
    planes = model.planes
    d, normals = planes.distances(x)
    near = np.flatnonzero(d < planes.dhat)
    size = barriers.planes.stiffness / weight * planes.areas[near] * np.abs(barrier_terms(d[near], planes.dhat)[1])
    for k, force in zip(near, size, strict=True):
        where = x[planes.vertices[k]] - 0.5 * d[k] * normals[k]
        other = surface.body_count + int(planes.obstacle[k])
        rows.append((where, normals[k], force * normals[k], float(d[k]), int(planes.owner[k]), other))
    return ContactPoints(
        points=np.array([row[0] for row in rows]).reshape(-1, 3),
        normals=np.array([row[1] for row in rows]).reshape(-1, 3),
        forces=np.array([row[2] for row in rows]).reshape(-1, 3),
        distances=np.array([row[3] for row in rows]),
        first=np.array([row[4] for row in rows], dtype=np.int32),
        second=np.array([row[5] for row in rows], dtype=np.int32),
        names=surface.names,
    )


def forces_on_owners(model: ContactModel, gradient: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    """Minus the gradient (n, 3) of a contact energy, summed over each body and obstacle: (3,) by name [N]."""
    bodies, obstacles = model.system.bodies, model.obstacles
    named = [(part.name, part.vertices) for part in bodies] + [(str(o.obstacle.name), o.vertices) for o in obstacles]
    return {name: -gradient[vertices].sum(axis=0) for name, vertices in named}
