"""How the areas of contacts depend on where the points of the surfaces are.

An area follows from the points of a contact and from those around them, see `supple.contact.features`. Central
differences find its derivatives: points that no area depends on together are moved at the same time (Curtis, Powell,
Reid, "On the Estimation of Sparse Jacobian Matrices", 1974).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, eye_array, kron

from supple.contact.barrier.barrier_energy import barrier_forces
from supple.contact.features.contact_set import contacts_at
from supple.contact.features.contacts import Contacts, KnownWeights
from supple.numerics.geometry.embedded_points import EmbeddedPoints
from supple.solvers.implicit.contact.collisions import Barrier, Collisions

# Of dhat: areas are linear in heights above surfaces, but for kinks, and these are shares of dhat.
_STEP = 1e-4

Sparse = Any


def area_derivatives(collisions: Collisions, x: NDArray[np.float64]) -> Sparse:
    """(k, 3 s) of the areas of all contacts at x (n, 3) by their points [m]; areas are those that belong to x."""
    mesh, dhat, s = collisions.mesh, collisions.dhat, len(collisions.mesh.points)
    every = collisions.points(x)
    points, here = every[:s], collisions.at(x)
    shape = len(here.kinds), every.size
    near = collisions.finder.at(points)
    margin = collisions.finder.reach * (1.0 + _STEP)
    near = near.where(*(found < margin for found in near.distances(mesh, points)))

    def areas(way: NDArray[np.float64]) -> NDArray[np.float64]:
        """(k,) the derivatives along a way (s, 3), whose longest entries are 1."""
        one, other = (
            _matched(here, contacts_at(points + e * way, mesh, *near_of, KnownWeights.none(), dhat).contacts)
            for e in (_STEP * dhat, -_STEP * dhat)
        )
        # A contact that is none on one side has the slope of the other.
        one, other = (np.where(np.isnan(a), 2.0 * here.weights - b, a) for a, b in ((one, other), (other, one)))
        return np.nan_to_num(one - other) / (2.0 * _STEP * dhat)

    near_of = near.vertex_triangle, near.edge_edge
    some = np.random.default_rng(0).uniform(-1.0, 1.0, (2, s, 3))
    rows = np.flatnonzero((areas(some[0]) != 0.0) | (areas(some[1]) != 0.0))
    if not len(rows):
        return csr_array(shape)
    on = _supports(here, mesh.edges, rows, s)
    colors = _colors(on)
    entries, columns = on.nonzero()
    values = np.zeros((len(entries), 3))
    for color in range(int(colors.max(initial=-1)) + 1):
        chosen = colors[columns] == color
        for axis in range(3):
            way = np.zeros((s, 3))
            way[colors == color, axis] = 1.0
            values[chosen, axis] = areas(way)[rows[entries[chosen]]]
    at = np.repeat(rows[entries], 3), (3 * columns[:, None] + np.arange(3)).ravel()
    return csr_array((values.ravel(), at), shape=shape)


def barrier_by_areas(barrier: Barrier, x: NDArray[np.float64], areas: Sparse) -> Sparse:
    """(3 n, 3 n) the derivative of the barrier's gradient at x (n, 3) by where contacts have their areas [N/m].

    areas : (k, 3 s) see `area_derivatives`
    """
    collisions = barrier.collisions
    contacts, points = collisions.at(x), collisions.half_spaces.points
    forces = barrier_forces(contacts, collisions.dhat, barrier.stiffness, barrier.soft)
    per_area = -forces / (contacts.weights * contacts.distances)
    values = (per_area[:, None] * contacts.coefficients)[:, :, None] * contacts.vectors[:, None, :]
    return by_areas(contacts.points, values, areas, points, len(x))


def by_areas(
    rows: NDArray[np.int32], forces: NDArray[np.float64], areas: Sparse, points: EmbeddedPoints, n: int
) -> Sparse:
    """(3 n, 3 n) of forces (k, 4, 3) per area on points (k, 4), and derivatives of areas (k, 3 s) by the points."""
    at = (3 * np.maximum(rows, 0)[:, :, None] + np.arange(3)).reshape(-1)
    owners = np.repeat(np.arange(len(rows)), 12)
    spread = csr_array((forces.ravel(), (at, owners)), shape=(areas.shape[1], len(rows)))
    W = embedding(points, n)
    return csr_array(W.T @ (spread @ areas) @ W)


def embedding(points: EmbeddedPoints, n: int) -> Sparse:
    """(3 s, 3 n) the matrix that takes positions of n vertices to those of the points."""
    own = csr_array((points.weights, points.vertices, points.start), shape=(len(points), n))
    return csr_array(kron(own, np.eye(3)))


def _matched(here: Contacts, there: Contacts) -> NDArray[np.float64]:
    """(k,) the areas that the contacts `here` have `there`; NaN for those that are not contacts there."""
    if np.array_equal(here.points[: len(there.points)], there.points):
        return np.append(there.weights, np.full(len(here.kinds) - len(there.kinds), np.nan))
    left: dict[Any, list[float]] = {}
    for points, kind, weight in zip(there.points.tolist(), there.kinds.tolist(), there.weights.tolist(), strict=True):
        left.setdefault((kind, *points), []).append(weight)
    out = np.full(len(here.kinds), np.nan)
    for k, (points, kind) in enumerate(zip(here.points.tolist(), here.kinds.tolist(), strict=True)):
        found = left.get((kind, *points))
        if found:
            out[k] = found.pop(0)
    return out


def _supports(contacts: Contacts, edges: NDArray[np.int32], rows: NDArray[np.int64], s: int) -> Sparse:
    """(r, s) what the areas of some contacts depend on: the points of all contacts of their first point, and those that
    edges join to them."""
    points = contacts.points
    own = np.flatnonzero((points < s).all(axis=1))
    contact, place = np.nonzero(points[own] >= 0)
    ones = np.ones(len(contact), dtype=np.int64)
    touched = csr_array((ones, (own[contact], points[own][contact, place])), shape=(len(points), s))
    first = csr_array((np.ones(len(own), dtype=np.int64), (own, points[own, 0])), shape=(len(points), s))
    joined = np.ones(len(edges), dtype=np.int64)
    next_to = csr_array((joined, (edges[:, 0], edges[:, 1])), shape=(s, s))
    return (first[rows] @ (first.T @ touched)) @ (next_to + next_to.T + eye_array(s))


def _colors(on: Sparse) -> NDArray[np.int64]:
    """(s,) colors of columns, of which no row has two with the same; -1 for empty ones."""
    together = csr_array(on.T @ on)
    out = np.full(on.shape[1], -1)
    for column in np.flatnonzero(np.diff(together.indptr)):
        taken = set(out[together.indices[together.indptr[column] : together.indptr[column + 1]]].tolist())
        out[column] = next(color for color in range(len(taken) + 1) if color not in taken)
    return out
