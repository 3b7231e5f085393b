"""What `Implicit.prepare` computes once for a system."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from supple.implicit.contact.model import ContactModel
from supple.implicit.damping import Viscosity
from supple.implicit.elasticity import Elasticity
from supple.implicit.newton import Tools
from supple.implicit.stabilizer import Stabilizer
from supple.implicit.stitch_energy import StitchEnergy
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
    last: NDArray[np.float64] | None = None

    @property
    def bodies_end(self) -> int:
        """The first vertex that is an obstacle's."""
        return max(part.vertices.stop for part in self.system.bodies)

    def with_obstacles(self, state: State) -> State:
        """A state whose arrays have the obstacles' vertices too."""
        if self.contact is None or not self.contact.obstacles:
            return state
        there = self.contact.obstacle_positions(state.time)
        return replace(
            state,
            positions=np.concatenate([state.positions, there]),
            velocities=np.concatenate([state.velocities, np.zeros_like(there)]),
        )

    def check_start(self, state: State) -> None:
        """Refuse a state from outside that has intersections; what a step ended with has none."""
        if self.contact is None or (self.last is not None and state.positions is self.last):
            return
