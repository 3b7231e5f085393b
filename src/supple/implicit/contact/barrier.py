"""The barrier: an energy that grows without bound as surfaces come together.

    E = sum_k a_k kappa dhat b(d_k^2 / dhat^2),  b(s) = -(s - 1)^2 ln s  for s < 1, else 0

over vertex-triangle and edge-edge pairs k with areas a_k: kappa is a pressure, so that neither the fineness of the mesh
nor the unit of length changes what it means.

Source: Li et al., "Incremental Potential Contact" (2020), equation 6; Li et al., "Convergent Incremental Potential
Contact" (2023), for the areas and the unit.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.contact.collision_mesh.collisions import Collisions
from supple.contact.collision_mesh.contact_surface import ContactSurface
from supple.errors import SolverError
from supple.implicit.energies.potential import ContactPotential, HessianBlocks


class LibraryPotential(ContactPotential):
    """A potential of the contact library. The library's arguments are positions, or, for friction, velocities.

    Attributes
    ----------
    surface : where the contacts are; potential : of the library
    unit : 1 for positions, the length of the step [s] for velocities
    """

    surface: ContactSurface
    potential: Any
    unit: float = 1.0

    @abstractmethod
    def library_arguments(self, x: NDArray[np.float64]) -> tuple[Any, Any, NDArray[np.float64]]:
        """The contacts at x (n, 3), the mesh, and the positions or velocities of its points."""

    def value(self, x: NDArray[np.float64]) -> float:
        arguments = self.library_arguments(x)
        return 0.0 if arguments[0].empty() else self.unit * float(self.potential(*arguments))

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        arguments = self.library_arguments(x)
        if not arguments[0].empty():
            self.surface.add_gradient(self.potential.gradient(*arguments), out)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        import ipctk

        arguments = self.library_arguments(x)
        if arguments[0].empty():
            return
        method = ipctk.PSDProjectionMethod.CLAMP if project else ipctk.PSDProjectionMethod.NONE
        try:
            hessian = self.potential.hessian(*arguments, method)
        except RuntimeError:
            # The library raises this for a distance of zero and for numbers out of range.
            raise SolverError(
                "contact: surfaces touch, or their distances leave what double precision can hold; start with a gap"
            ) from None
        out.couplings.append(self.surface.couplings(hessian / self.unit))


class Barrier(LibraryPotential):
    """Between triangles of bodies and obstacles.

    Parameters
    ----------
    stiffness : kappa [Pa]
    """

    def __init__(self, collisions: Collisions, stiffness: float) -> None:
        import ipctk

        self.collisions = collisions
        self.surface = collisions.surface
        self.potential = ipctk.BarrierPotential(collisions.dhat, stiffness=stiffness, use_physical_barrier=True)

    def library_arguments(self, x: NDArray[np.float64]) -> tuple[Any, Any, NDArray[np.float64]]:
        return self.collisions.at(x), self.surface.mesh, self.collisions.points(x)
