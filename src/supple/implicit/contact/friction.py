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


class Friction(LibraryPotential):
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
