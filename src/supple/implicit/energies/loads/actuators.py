"""Actuators as potentials: U(s) of the coordinate s, with the force Q = -dU/ds.

The Hessian is U'' grad s grad s^T - Q hess s. Its first part couples all vertices of the actuator. It is kept as a
product of two vectors, which the linear solver adds to its sparse matrix.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.implicit.energies.potential import HessianBlocks, Potential, Projection
from supple.loads.actuators.actuator import Actuator, Coordinate
from supple.loads.actuators.laws import ForceLaw
from supple.numerics.sparse.low_rank import RankOne
from supple.system import System

# How much stiffer than the body a prescribed coordinate is held within a minimization: the error of the constraint
# decreases by this factor in each iteration, and higher ones make the steps shorter.
_PENALTY = 100.0


@dataclass(frozen=True, eq=False)
class ActuatorPotential(Potential):
    """One actuator in one step. Its law may have an unknown of its own, so that it serves one minimization."""

    coordinate: Coordinate
    law: ForceLaw
    projection = Projection.RELEASED_FIRST

    def value(self, x: NDArray[np.float64]) -> float:
        return self.law.energy(self.at(x))

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        own = x[self.coordinate.vertices]
        force = self.law.force(self.coordinate.value(own))
        out[self.coordinate.vertices] -= force * self.coordinate.gradient(own)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        own = x[self.coordinate.vertices]
        s = self.coordinate.value(own)
        stiffness = self.law.stiffness(s)
        if stiffness > 0.0:
            vector = np.sqrt(stiffness) * self.coordinate.gradient(own)
            out.low_rank.append(RankOne(self.coordinate.vertices, vector))
        bending = self.coordinate.hessian(own, -self.law.force(s), project)
        if bending is not None:
            out.loads.append(bending)

    def renew(self, x: NDArray[np.float64], direction: NDArray[np.float64]) -> None:
        rows = self.coordinate.vertices
        change = float(np.einsum("ij,ij->", self.coordinate.gradient(x[rows]), direction[rows]))
        self.law.renew(self.at(x) + change)

    def at(self, x: NDArray[np.float64]) -> float:
        """s at x (n, 3)."""
        return self.coordinate.value(x[self.coordinate.vertices])

    def force(self, x: NDArray[np.float64]) -> float:
        """Q at x (n, 3)."""
        return self.law.force(self.at(x))


def actuators_at(
    system: System, x: NDArray[np.float64], time: float, scale: float | None, mu: NDArray[np.float64]
) -> list[ActuatorPotential]:
    """The actuators in a step to `time` [s].

    Parameters
    ----------
    x : (n, 3) where the step begins [m]; scale : s of the inertia term [s^2]; None without inertia
    mu : (m,) shear modulus of all tets [Pa]
    """
    found = []
    for each in system.actuators:
        penalty = _PENALTY * _stiffness(system, each, x, scale, mu)
        found.append(ActuatorPotential(each.coordinate, each.law.at(time, penalty)))
    return found


def _stiffness(
    system: System, actuator: Actuator, x: NDArray[np.float64], scale: float | None, mu: NDArray[np.float64]
) -> float:
    """An estimate of d^2 E / ds^2 of the energy of the bodies about an actuator."""
    rows = actuator.coordinate.vertices
    touched = np.zeros(len(x), dtype=np.bool_)
    touched[rows] = True
    tets = touched[system.tets].any(axis=1)
    elastic = float(mu[tets] @ system.rest_volumes[tets]) / actuator.start**2
    if scale is None:
        return elastic
    gradient = actuator.coordinate.gradient(x[rows])
    moved = float(np.einsum("i,ij,ij->", scale / system.masses[rows], gradient, gradient))
    return elastic + 1.0 / moved
