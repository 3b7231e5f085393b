"""What loads of a scene are built with: the bodies, and their numbers in the arrays of a system."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.scene.body import PlacedBody


@dataclass(frozen=True, eq=False)
class Setting:
    """The bodies of a scene where a simulation begins.

    Attributes
    ----------
    begins : by body name, the number of its first vertex; masses : (n,) of all vertices [kg]
    x : (n, 3) where the simulation begins [m]
    """

    bodies: Sequence[PlacedBody]
    begins: dict[str, int]
    masses: NDArray[np.float64]
    x: NDArray[np.float64]

    def body(self, name: str) -> PlacedBody:
        """The body of that name."""
        return next(body for body in self.bodies if body.name == name)

    def first_tet(self, name: str) -> int:
        """The number of a body's first tet among those of all bodies."""
        return sum(len(body.mesh.tets) for body in self.bodies[: [body.name for body in self.bodies].index(name)])
