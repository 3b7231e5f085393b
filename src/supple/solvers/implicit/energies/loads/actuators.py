"""Actuators as potentials: U(s) of the coordinate s, with the force Q = -dU/ds, and friction between its parts.

The Hessian is U'' grad s grad s^T - Q hess s. Its first part couples all vertices of the actuator. It is kept as a
product of two vectors, which the linear solver adds to its sparse matrix. Friction adds such products, too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.model.loads.actuators.actuator import Actuator, Coordinate
from supple.model.loads.actuators.cables import CREEP, CableLength, EyeletFriction, span_forces
from supple.model.loads.actuators.laws import ForceLaw
from supple.model.loads.muscles import FibreTension
from supple.model.system import System
from supple.numerics.sparse.couplings import RankOne
from supple.solvers.implicit.energies.loads.springs import LoadPotential
from supple.solvers.implicit.energies.potential import HessianBlocks, Potential, Projection


@dataclass(frozen=True, eq=False)
class MusclePotential(LoadPotential):
    """The muscles of a scene."""

    loads: tuple[FibreTension, ...]

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        """By F d: a S (f' n n^T + f / s (1 - n n^T)); with `project`, the first term where it is positive."""
        for m in self.loads:
            stretches, n = m.fibres(x)
            along, across = m.slope(stretches), m.share(stretches) / np.where(stretches > 0.0, stretches, np.inf)
            if project:
                along = np.maximum(along, 0.0)
            factors = m.activation(self.time) * m.strengths
            by_way = (factors * (along - across))[:, None, None] * n[:, :, None] * n[:, None, :]
            by_way += (factors * across)[:, None, None] * np.eye(3)
            blocks = np.einsum("mp,mq,mij->mpiqj", m.coefficients, m.coefficients, by_way)
            out.tets[m.fibres_at_rest.rows] += blocks.reshape(-1, 12, 12)


def muscles_at(system: System, time: float) -> list[MusclePotential]:
    """The muscles of a system at `time` [s]; no term where there are none."""
    muscles = tuple(load for load in system.loads if isinstance(load, FibreTension))
    return [MusclePotential(muscles, time)] if muscles else []


# How much stiffer than the body a prescribed coordinate is held within a minimization: the error of the constraint
# decreases by this factor in each iteration, and higher ones make the steps shorter.
_PENALTY = 100.0


@dataclass(frozen=True, eq=False)
class ActuatorPotential(Potential):
    """One actuator in one step. It may have unknowns of its own, so that it serves one minimization."""

    coordinate: Coordinate
    law: ForceLaw
    eyelets: EyeletFriction | None = None
    projection = Projection.RELEASED_FIRST

    def value(self, x: NDArray[np.float64]) -> float:
        parts = self.coordinate.parts(x[self.coordinate.vertices])
        energy = self.law.energy(float(parts.sum()))
        return energy if self.eyelets is None else energy + self.eyelets.energy(parts)

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        rows = self.coordinate.vertices
        gradients = self.coordinate.part_gradients(x[rows])
        out[rows] -= np.einsum("p,pij->ij", self.forces(x), gradients)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        rows = self.coordinate.vertices
        own = x[rows]
        parts, gradients = self.coordinate.parts(own), self.coordinate.part_gradients(own)
        stiffness = self.law.stiffness(float(parts.sum()))
        if stiffness > 0.0:
            out.low_rank.append(RankOne(rows, np.sqrt(stiffness) * gradients.sum(axis=0)))
        if self.eyelets is not None:
            for k, grip in enumerate(self.eyelets.stiffness(parts)):
                if grip > 0.0:
                    out.low_rank.append(RankOne(rows, np.sqrt(grip) * gradients[: k + 1].sum(axis=0)))
        bending = self.coordinate.hessian(own, -self.forces(x), project)
        if bending is not None:
            out.loads.append(bending)

    def renew(self, x: NDArray[np.float64], direction: NDArray[np.float64]) -> None:
        rows = self.coordinate.vertices
        change = float(np.einsum("ij,ij->", self.coordinate.gradient(x[rows]), direction[rows]))
        self.law.renew(self.coordinate.value(x[rows]) + change)
        if self.eyelets is not None and isinstance(self.coordinate, CableLength):
            parts, directions = self.coordinate.spans(x[rows] + direction[rows])
            self.eyelets.renew(parts, directions, -self.law.force(float(parts.sum())))

    def forces(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(p,) generalized forces on the parts at x (n, 3)."""
        parts = self.coordinate.parts(x[self.coordinate.vertices])
        force = self.law.force(float(parts.sum()))
        if self.eyelets is None:
            return np.full(len(parts), force)
        return span_forces(force, self.eyelets.forces(parts))


def actuators_at(
    system: System, x: NDArray[np.float64], span: tuple[float, float], scale: float | None, mu: NDArray[np.float64]
) -> list[ActuatorPotential]:
    """The actuators in a step.

    Parameters
    ----------
    x : (n, 3) where the step begins [m]; span : times of its beginning and its end [s]
    scale : s of the inertia term [s^2]; None without inertia; mu : (m,) shear modulus of all tets [Pa]
    """
    found = []
    for each in system.actuators:
        own = x[each.coordinate.vertices]
        penalty = _PENALTY * _stiffness(system, each, x, scale, mu)
        law, eyelets = each.law.at(span[1], penalty), None
        if each.friction > 0.0 and isinstance(each.coordinate, CableLength):
            parts, directions = each.coordinate.spans(own)
            eyelets = EyeletFriction(each.friction, parts, CREEP * each.start * (span[1] - span[0]))
            eyelets.renew(parts, directions, -law.force(float(parts.sum())))
        found.append(ActuatorPotential(each.coordinate, law, eyelets))
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
