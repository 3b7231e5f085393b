"""The barrier: an energy that grows without bound as surfaces come together.

    E = sum_k a_k kappa dhat b(d_k^2 / dhat^2),  b(s) = -(s - 1)^2 ln s  for s < 1, else 0

over vertex-triangle and edge-edge pairs k with areas a_k: kappa is a pressure, so that neither the fineness of the mesh
nor the unit of length changes what it means.

Source: Li et al., "Incremental Potential Contact" (2020), equation 6; Li et al., "Convergent Incremental Potential
Contact" (2023), for the areas and the unit.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.contact.collision_mesh.collisions import Collisions
from supple.errors import SolverError
from supple.implicit.energies.potential import ContactPotential, HessianBlocks


class Barrier(ContactPotential):
    """Between triangles of bodies and obstacles.

    Parameters
    ----------
    stiffness : kappa [Pa]
    """

    def __init__(self, collisions: Collisions, stiffness: float) -> None:
        import ipctk

        self.collisions = collisions
        self.potential = ipctk.BarrierPotential(collisions.dhat, stiffness=stiffness, use_physical_barrier=True)

    def value(self, x: NDArray[np.float64]) -> float:
        found = self.collisions.at(x)
        if found.empty():
            return 0.0
        return float(self.potential(found, self.collisions.surface.mesh, self.collisions.points(x)))

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        found = self.collisions.at(x)
        if not found.empty():
            surface = self.collisions.surface
            surface.add_gradient(self.potential.gradient(found, surface.mesh, self.collisions.points(x)), out)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        found = self.collisions.at(x)
        if not found.empty():
            import ipctk

            method = ipctk.PSDProjectionMethod.CLAMP if project else ipctk.PSDProjectionMethod.NONE
            surface = self.collisions.surface
            try:
                hessian = self.potential.hessian(found, surface.mesh, self.collisions.points(x), method)
            except RuntimeError:
                # The library raises this for a distance of zero and for numbers out of range.
                raise SolverError(
                    "contact: surfaces touch, or their distances leave what double precision can hold; start with a gap"
                ) from None
            out.couplings.append(surface.blocks(hessian, len(x)))
