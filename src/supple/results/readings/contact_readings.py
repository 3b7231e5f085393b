"""Contact forces and pressures on the surfaces of bodies."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.model.state import ContactPoints


def contact_forces(contacts: ContactPoints | None, count: int) -> NDArray[np.float64]:
    """(count, 3) the force of all contacts on each vertex, friction included [N]; zero without contacts."""
    if contacts is None:
        return np.zeros((count, 3))
    return contacts.on_vertices(contacts.forces + contacts.friction, count)


def contact_pressures(
    contacts: ContactPoints | None, x: NDArray[np.float64], triangles: NDArray[np.int32]
) -> NDArray[np.float64]:
    """(n,) normal force per area at each vertex [Pa]; zero where nothing touches, or where no triangle is pushed.

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
