"""What `Implicit.prepare` computes once for a system."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from supple.implicit.contact.model import ContactModel
from supple.implicit.energies.damping import Viscosity
from supple.implicit.energies.elasticity import Elasticity
from supple.implicit.energies.regularization import Stabilizer
from supple.implicit.energies.stitch_damping import StitchViscosity
from supple.implicit.energies.stitches import StitchEnergy
from supple.implicit.newton.minimize import Tools
from supple.state import State
from supple.system import System


@dataclass(eq=False)
class Workspace:
    """What `Implicit.prepare` computes once.

    Attributes
    ----------
    system : with the obstacles' vertices after the bodies'
    diagonal : of the smallest body's bounding box at rest [m]
    last : the positions that the latest step ended with
    """

    system: System
    contact: ContactModel | None
    elasticity: Elasticity
    viscosity: Viscosity | None
    tools: Tools
    diagonal: float
    stabilizer: Stabilizer
    stitches: StitchEnergy | None
    stitch_viscosity: StitchViscosity | None
    last: NDArray[np.float64] | None = None

    @property
    def bodies_end(self) -> int:
        """The first vertex that is an obstacle's."""
        return max(part.vertices.stop for part in self.system.bodies)

    def taken_in(self, state: State) -> State:
        """A state with the obstacles' vertices after the bodies'.

        Raises
        ------
        SolverError : where a state from outside has surfaces that intersect; what a step ended with has none.
        """
        if self.contact is None:
            return state
        known = state.positions is self.last
        if self.contact.obstacles:
            there = self.contact.obstacle_positions(state.time)
            state = replace(
                state,
                positions=np.concatenate([state.positions, there]),
                velocities=np.concatenate([state.velocities, np.zeros_like(there)]),
            )
        if not known:
            self.contact.raise_if_intersecting(state.positions, state.time)
        return state
