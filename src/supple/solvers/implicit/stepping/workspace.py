"""The data that `Implicit.prepare` computes once for a system."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from supple.contact.mesh.obstacles import obstacle_positions
from supple.materials.elastic_tets.active import Growth
from supple.model.joints.geometry import JointGeometry
from supple.model.state import State
from supple.model.stitched_points import stitched_state
from supple.model.system import System
from supple.solvers.implicit.contact.model import ContactModel
from supple.solvers.implicit.energies.elasticity import Elasticity, elasticity_of
from supple.solvers.implicit.energies.regularization import Regularization
from supple.solvers.implicit.energies.stitch_damping import Damper
from supple.solvers.implicit.energies.stitches import StitchEnergy
from supple.solvers.implicit.newton.direction import Tools
from supple.solvers.implicit.stepping.conservation import Conservation


@dataclass(eq=False)
class Workspace:
    """The data that `Implicit.prepare` computes once.

    Attributes
    ----------
    system : with the stitched points of rigid bodies after the bodies' vertices, and then the obstacles' vertices
    diagonal : of the smallest body's bounding box at rest [m]
    checked : the state that `Implicit.check` has accepted, or that the latest step ended with
    grown : the latest growth, and the elastic energy with it
    tape : where a list is given, the `Ending` of every substep that is taken is appended
    settle : see `Ending`
    """

    system: System
    contact: ContactModel | None
    elasticity: Elasticity
    tools: Tools
    diagonal: float
    regularization: Regularization
    stitches: StitchEnergy | None
    dampers: tuple[Damper, ...]
    joints: JointGeometry | None
    checked: State | None = None
    grown: tuple[Growth, Elasticity] | None = None
    tape: list[Any] | None = None
    settle: Callable[[Any, Workspace], Any] | None = None
    conservation: Conservation = field(init=False)

    def __post_init__(self) -> None:
        self.conservation = Conservation.of(self.system, self.elasticity, self.stitches, self.tools.free_motion)

    @property
    def counts(self) -> tuple[int, int]:
        """How many linear systems have been solved, and how many searches for contacts made."""
        return self.tools.linear_solver.solves, 0 if self.contact is None else self.contact.searches

    @property
    def bodies_end(self) -> int:
        """The first vertex that is an obstacle's."""
        obstacles = () if self.contact is None else self.contact.obstacles
        return len(self.system.rest_positions) - sum(len(part.vertices) for part in obstacles)

    def elasticity_at(self, time: float) -> Elasticity:
        """The elastic energy of the stress-free shapes at `time` [s]."""
        laws = self.system.laws_at(time)
        if laws.growth is None:
            return self.elasticity
        if self.grown is None or not laws.growth.equals(self.grown[0]):
            free = laws.stress_free
            shapes = {"rest_shape_inverse": free.Dm_inv, "rest_volumes": free.volumes, "quadratic": free.quadratic}
            self.grown = laws.growth, elasticity_of(replace(self.system, **shapes))
            self.conservation = replace(self.conservation, elasticity=self.grown[1], latest=None)
        return self.grown[1]

    def extended(self, state: State) -> State:
        """A state of the bodies as one of all vertices of `system`."""
        state = stitched_state(self.system, state)
        if self.contact is None or not self.contact.obstacles:
            return state
        there = obstacle_positions(self.contact.obstacles, state.time)
        return replace(
            state,
            positions=np.concatenate([state.positions, there]),
            velocities=np.concatenate([state.velocities, np.zeros_like(there)]),
        )
