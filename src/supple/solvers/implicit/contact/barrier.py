"""The barrier between triangles of bodies and obstacles: an energy that grows without bound as surfaces come together.

    E = sum_k a_k kappa dhat b(d_k^2 / dhat^2),  b(s) = -(s - 1)^2 ln s  for s < 1, else 0

over the contacts k of `supple.contact.features.contact_set` with areas a_k: kappa is a pressure, so that neither the
fineness of the mesh nor the unit of length changes what it means.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.contact.barrier.barrier_energy import add_barrier_gradient, barrier_energy, barrier_hessian
from supple.numerics.geometry.embedded_points import vertex_couplings
from supple.solvers.implicit.contact.collisions import Collisions
from supple.solvers.implicit.energies.potential import ContactPotential, HessianBlocks


@dataclass(frozen=True, eq=False)
class Barrier(ContactPotential):
    """Of the contacts that `collisions` finds; stiffness : kappa [Pa]."""

    collisions: Collisions
    stiffness: float

    def value(self, x: NDArray[np.float64]) -> float:
        contacts = self.collisions.at(x)
        return barrier_energy(contacts, self.collisions.dhat, self.stiffness) if len(contacts.kinds) else 0.0

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        contacts = self.collisions.at(x)
        if len(contacts.kinds):
            forces = np.zeros_like(self.collisions.points(x))
            add_barrier_gradient(contacts, self.collisions.dhat, self.stiffness, forces)
            self.collisions.mesh.points.add_forces(forces, out)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        contacts, points = self.collisions.at(x), self.collisions.points(x)
        if len(contacts.kinds):
            between = barrier_hessian(points, contacts, self.collisions.dhat, self.stiffness, project)
            out.couplings.append(vertex_couplings(self.collisions.mesh.points, between))

    def add_model(
        self, x: NDArray[np.float64], gradient: NDArray[np.float64], hessian: HessianBlocks | None, project: bool
    ) -> float:
        # All at once is asked for where the search for the minimum goes on.
        self.collisions.keep_weights(x)
        return super().add_model(x, gradient, hessian, project)
