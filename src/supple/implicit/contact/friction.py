"""Lagged, smoothed Coulomb friction between triangles.

Normal forces, directions and points of contact are those of a given state; the force on the relative displacement u in
the tangent plane since the step began is mu lambda f1(|u|), which rises smoothly from zero to mu lambda at the
displacement eps_v h: below it friction is static.

Source: Li et al., "Incremental Potential Contact" (2020), section 5.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.contact.collision_mesh.contact_surface import ContactSurface
from supple.contact.potentials.friction_energy import (
    Slips,
    add_friction_gradient,
    friction_energy,
    friction_hessian,
    renew_duals,
)
from supple.implicit.contact.barrier import Barrier
from supple.implicit.energies.potential import FrictionPotential, HessianBlocks
from supple.numerics.sparse.couplings import Couplings


@dataclass(frozen=True, eq=False)
class Friction(FrictionPotential):
    """Of contacts between the points of a surface.

    Attributes
    ----------
    reach : eps_v h [m]
    found : the library's contacts
    duals : (k, 3) the state of a minimization, see `friction_energy`; zero at first: the step is that of the majorizer
    """

    surface: ContactSurface
    slips: Slips
    reach: float
    found: Any
    duals: NDArray[np.float64] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "duals", np.zeros((len(self.slips.forces), 3)))

    def value(self, x: NDArray[np.float64]) -> float:
        return friction_energy(self._points(x), self.slips, self.reach)

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        points = self._points(x)
        forces = np.zeros_like(points)
        add_friction_gradient(points, self.slips, self.reach, forces)
        self.surface.add_gradient(forces.ravel(), out)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        """The matrix of a primal-dual step, positive semi-definite without projection."""
        between = friction_hessian(self._points(x), self.slips, self.reach, self.duals)
        out.couplings.append(self._by_vertices(between))

    def renew(self, x: NDArray[np.float64], direction: NDArray[np.float64]) -> None:
        renew_duals(self._points(x), self._points(direction), self.slips, self.reach, self.duals)

    def _points(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.ascontiguousarray(self.surface.points(x))

    def _by_vertices(self, between: Couplings) -> Couplings:
        s = len(self.surface.vertices)
        ends = np.concatenate(
            [np.column_stack([self.surface.vertices] * 2), self.surface.vertices[self.surface.middles]]
        )
        shares = np.repeat([[1.0, 0.0], [0.5, 0.5]], [s, len(ends) - s], axis=0)
        rows, columns, blocks = [], [], []
        same = between.rows == between.columns
        for a in range(2):
            for b in range(2):
                i, j = ends[between.rows, a], ends[between.columns, b]
                size = shares[between.rows, a] * shares[between.columns, b]
                size = size * np.where(same, 1.0 if a == b else 0.5, np.where(i == j, 2.0, 1.0))
                kept = size != 0.0
                rows.append(i[kept])
                columns.append(j[kept])
                blocks.append((size[:, None, None] * between.blocks)[kept])
        return Couplings(*(np.concatenate(part) for part in (rows, columns, blocks)))


def friction(
    barrier: Barrier,
    lagged: NDArray[np.float64],
    start: NDArray[np.float64],
    coefficients: NDArray[np.float64],
    reach: float,
) -> Friction | None:
    """Of the contacts that a barrier has at one state; None where there are none.

    Parameters
    ----------
    lagged : (n, 3) positions of which normal forces and tangents are used; start : (n, 3) where the step began
    coefficients : (p, p) between owners of the surface
    reach : eps_v h [m]
    """
    import ipctk

    surface = barrier.collisions.surface
    found = barrier.collisions.at(lagged)
    if found.empty() or not coefficients.any():
        return None
    owner = surface.owner.astype(np.float64)

    def blend(a: float, b: float) -> float:
        """The library combines numbers of vertices. Here these are owners, and the pair is looked up."""
        return float(coefficients[round(a), round(b)])

    contacts = ipctk.TangentialCollisions()
    points = barrier.collisions.points(lagged)
    contacts.build(surface.mesh, points, found, barrier.potential, owner, owner, blend)
    k = len(contacts)
    kinds, ids, weights = np.zeros(k, dtype=np.int8), np.full((k, 4), -1, dtype=np.int32), np.zeros((k, 4))
    normals, forces = np.empty((k, 3)), np.empty(k)
    for row in range(k):
        contact = contacts[row]
        own = [v for v in contact.vertex_ids(surface.mesh.edges, surface.mesh.faces) if v >= 0]
        unit = np.eye(3 * len(own))[::3]
        ids[row, : len(own)] = own
        weights[row, : len(own)] = [contact.relative_velocity(e)[0] for e in unit]
        kinds[row] = len(own) - 2
        normals[row] = np.cross(*np.asarray(contact.tangent_basis).T)
        forces[row] = contact.weight * contact.mu_k * contact.normal_force_magnitude
    offsets = np.einsum("ki,kij->kj", weights, np.asarray(surface.points(start))[ids])
    return Friction(surface, Slips(kinds, ids, weights, normals, offsets, forces), reach, contacts)
