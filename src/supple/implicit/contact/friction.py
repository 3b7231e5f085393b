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
        self._g = {}
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
        majorizer = np.zeros((0, 3, 3))
        mesh = self.surface.mesh
        points = self.surface.points(x) - self.start
        ids, factors, blocks = [], [], []
        reach = self.slow * self.unit
        for k in range(len(self.contacts)):
            c = self.contacts[k]
            v = [i for i in c.vertex_ids(mesh.edges, mesh.faces) if i >= 0]
            T = np.asarray(c.tangent_basis)
            if k not in self._g:
                g = np.zeros(len(v))
                for a in range(len(v)):
                    e = np.zeros(3 * len(v)); e[3 * a] = 1.0
                    g[a] = c.relative_velocity(e)[0]
                self._g[k] = g
            g = self._g[k]
            u = T.T @ (g @ points[v])
            y = np.linalg.norm(u)
            w = c.weight * c.mu_k * c.normal_force_magnitude * (2 / reach - y / reach**2 if y < reach else 1 / y)
            B = w * T @ T.T
            ids.append(v); factors.append(g); blocks.append(B)
        from supple.numerics.sparse.couplings import Couplings
        W = None
        rows, cols, data = [], [], []
        for v, g, B in zip(ids, factors, blocks):
            # middles
            vs, gs = [], []
            for i, gi in zip(v, g):
                s = len(self.surface.vertices)
                if i < s:
                    vs.append(self.surface.vertices[i]); gs.append(gi)
                else:
                    for m in self.surface.middles[i - s]:
                        vs.append(self.surface.vertices[m]); gs.append(0.5 * gi)
            for a in range(len(vs)):
                for b in range(len(vs)):
                    if vs[a] < vs[b] or a == b or (vs[a] == vs[b] ):
                        rows.append(vs[a]); cols.append(vs[b]); data.append(gs[a] * gs[b] * B)
        out.couplings.append(Couplings(np.array(rows, np.int32), np.array(cols, np.int32), np.array(data)))
