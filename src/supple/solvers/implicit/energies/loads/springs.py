"""Springs between points of bodies: k / 2 (l - l0)^2, l = |r|, r = sum c_i x_i + offset."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.model.loads.muscles import FibreTension
from supple.model.loads.springs import PointSpring
from supple.model.system import System
from supple.numerics.sparse.couplings import Couplings
from supple.solvers.implicit.energies.potential import HessianBlocks, Potential, Projection
from supple.solvers.implicit.energies.stitches import spring_matrices
from supple.solvers.implicit.energies.vertex_potential import VertexPotential


def soft_targets_at(system: System, time: float) -> list[VertexPotential]:
    """The scene's soft targets, springs of rest length zero, with their positions at `time` [s]."""
    n, found = len(system.rest_positions), []
    for part in system.soft_targets:
        places = np.zeros((n, 3))
        places[part.vertices] = part.targets(time)
        stiffness = np.zeros((n, 3))
        np.add.at(stiffness, part.vertices, part.target.stiffness)
        found.append(VertexPotential(places, stiffness, np.zeros((n, 3)), "soft_targets"))
    return found


@dataclass(frozen=True, eq=False)
class LoadPotential(Potential):
    """Loads with an energy at `time` [s]."""

    loads: tuple[PointSpring | FibreTension, ...]
    time: float
    projection = Projection.RELEASED_FIRST

    def value(self, x: NDArray[np.float64]) -> float:
        return sum(load.energy(x, self.time) for load in self.loads)

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        pull = np.zeros_like(out)
        for load in self.loads:
            load.add_forces(x, self.time, pull)
        out -= pull


@dataclass(frozen=True, eq=False)
class SpringPotential(LoadPotential):
    """The springs of a scene."""

    loads: tuple[PointSpring, ...]
    work = "springs"

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        """By r: k n n^T + k (1 - l0 / l) (I - n n^T); with `project`, the second term only where it is positive."""
        for spring in self.loads:
            length, n = spring.length(x)
            rest = np.array([spring.rest_length(self.time)])
            by_r = spring_matrices(np.array([spring.stiffness]), rest, np.array([length]), n[None], project)
            c, (i, j) = spring.coefficients, np.triu_indices(len(spring.vertices))
            blocks = (c[i] * c[j])[:, None, None] * by_r
            out.loads.append(Couplings(spring.vertices[i], spring.vertices[j], blocks))


def springs_at(system: System, time: float) -> list[SpringPotential]:
    """The scene's springs at `time` [s]; no term where there are none."""
    springs = tuple(load for load in system.loads if isinstance(load, PointSpring))
    return [SpringPotential(springs, time)] if springs else []
