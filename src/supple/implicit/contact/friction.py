"""Lagged, smoothed Coulomb friction between triangles.

Normal forces, directions and points of contact are those of a given state; the force on the relative displacement u in
the tangent plane since the step began is mu lambda f1(|u|), which rises smoothly from zero to mu lambda at the
displacement eps_v h: below it friction is static.

Source: Li et al., "Incremental Potential Contact" (2020), section 5.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.implicit.contact.barrier import Barrier, LibraryPotential
from supple.implicit.energies.potential import FrictionPotential, HessianBlocks
from supple.numerics.sparse.couplings import Couplings


class Friction(LibraryPotential, FrictionPotential):
    """Of the contacts that a barrier has at one state.

    Parameters
    ----------
    lagged : (n, 3) positions of which normal forces and tangents are used
    start : (n, 3) where the step began; h : its length [s]
    coefficients : (p, p) between owners of the surface
    slow : eps_v [m/s]
    """

    def __init__(
        self,
        barrier: Barrier,
        lagged: NDArray[np.float64],
        start: NDArray[np.float64],
        h: float,
        coefficients: NDArray[np.float64],
        slow: float,
    ) -> None:
        import ipctk

        self.surface = barrier.collisions.surface
        self.start = self.surface.points(start)
        self.unit = h
        self.slow = slow
        self.potential = ipctk.FrictionPotential(slow)
        self.contacts = ipctk.TangentialCollisions()
        found = barrier.collisions.at(lagged)
        if not found.empty() and coefficients.any():
            owner = self.surface.owner.astype(np.float64)

            def blend(a: float, b: float) -> float:
                """The library combines numbers of vertices. Here these are owners, and the pair is looked up."""
                return float(coefficients[round(a), round(b)])

            points = barrier.collisions.points(lagged)
            self.contacts.build(self.surface.mesh, points, found, barrier.potential, owner, owner, blend)

    def library_arguments(self, x: NDArray[np.float64]) -> tuple[Any, Any, NDArray[np.float64]]:
        return self.contacts, self.surface.mesh, np.asfortranarray((self.surface.points(x) - self.start) / self.unit)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        if not project:
            super().add_hessian(x, out, True)
            return
        mesh, surface = self.surface.mesh, self.surface
        moved = surface.points(x) - self.start
        reach = self.slow * self.unit
        rows, columns, blocks = [], [], []
        for k in range(len(self.contacts)):
            contact = self.contacts[k]
            points = [v for v in contact.vertex_ids(mesh.edges, mesh.faces) if v >= 0]
            basis = np.asarray(contact.tangent_basis)
            unit = np.eye(3 * len(points))[::3]
            weights = np.array([contact.relative_velocity(e)[0] for e in unit])
            y = float(np.linalg.norm(basis.T @ (weights @ moved[points])))
            force = contact.weight * contact.mu_k * contact.normal_force_magnitude
            block = force * (2.0 / reach - y / reach**2 if y < reach else 1.0 / y) * basis @ basis.T
            ends = [(v, w) for p, c in zip(points, weights, strict=True) for v, w in self._ends(p, c)]
            for a in range(len(ends)):
                for b in range(a, len(ends)):
                    twice = 2.0 if a != b and ends[a][0] == ends[b][0] else 1.0
                    rows.append(ends[a][0])
                    columns.append(ends[b][0])
                    blocks.append(twice * ends[a][1] * ends[b][1] * block)
        pairs = np.array([rows, columns], dtype=np.int32).reshape(2, -1)
        out.couplings.append(Couplings(*pairs, np.array(blocks).reshape(-1, 3, 3)))

    def _ends(self, point: int, weight: float) -> list[tuple[int, float]]:
        """The solver's vertices that a point of the mesh depends on, with their shares of its weight."""
        s = len(self.surface.vertices)
        if point < s:
            return [(int(self.surface.vertices[point]), weight)]
        return [(int(v), 0.5 * weight) for v in self.surface.vertices[self.surface.middles[point - s]]]
