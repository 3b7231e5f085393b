"""The works of contact forces over the displacements of a substep, row by row: most points have no contact."""

from __future__ import annotations

import numpy as np

from supple.numerics.geometry.embedded_points import EmbeddedPoints
from supple.numerics.mat3 import dot, row
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.contact.frame_forces import FrameForces


def contact_works(forces: FrameForces, points: EmbeddedPoints, x: np.ndarray, begun: np.ndarray) -> dict[str, float]:
    """Those of the forces of the latest substep along normals, `contact`, and along surfaces, `friction` [J].

    points : of the system; x, begun : (n, >= 3) its vertices when the substep ends and began [m]
    """
    works = np.zeros(2)
    moved = (points.start, points.vertices, points.weights, x, begun)
    rows, loads = forces.latest
    owners = forces.owners
    if rows is not None:
        _add_rows(owners.rows, rows.vertices, rows.weights, rows.normals, rows.forces, moved, works)
    if loads is not None:
        pushes = owners.masses[loads.vertices, None] * loads.loads
        _add_vertices(owners.tested[loads.vertices], loads.places, pushes, moved, works)
    return {"contact": float(works[0]), "friction": float(works[1])}


@njit
def _displacement(i, moved):
    """That of point i."""
    start, vertices, weights, x, begun = moved
    a = b = c = 0.0
    for k in range(start[i], start[i + 1]):
        v, w = vertices[k], weights[k]
        a, b, c = a + w * (x[v, 0] - begun[v, 0]), b + w * (x[v, 1] - begun[v, 1]), c + w * (x[v, 2] - begun[v, 2])
    return (a, b, c)


@njit(cache=True)
def _add_rows(owners, vertices, weights, normals, forces, moved, works):
    """Add the works of forces (k, 3) on points (k, 4) of surfaces, of which the first have owners."""
    for k in range(len(forces)):
        x = y = z = 0.0
        for slot in range(4):
            if vertices[k, slot] < len(owners):
                d, c = _displacement(owners[vertices[k, slot]], moved), weights[k, slot]
                x, y, z = x + c * d[0], y + c * d[1], z + c * d[2]
        _add(row(forces, k), row(normals, k), (x, y, z), works)


@njit(cache=True)
def _add_vertices(points, places, forces, moved, works):
    """Add the works of forces (k, 3) on points (k,), with normals in the first columns of `places`."""
    for k in range(len(points)):
        _add(row(forces, k), row(places, k), _displacement(points[k], moved), works)


@njit
def _add(force, normal, way, works):
    along = dot(force, normal) * dot(normal, way)
    works[0] += along
    works[1] += dot(force, way) - along
