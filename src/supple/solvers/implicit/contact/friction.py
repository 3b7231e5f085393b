"""Lagged, smoothed Coulomb friction, between triangles and with half-spaces.

Normal forces, directions and points of contact are those of a given state; the force on the relative displacement u in
the tangent plane since the step began is mu lambda f1(|u|), which rises smoothly from zero to mu lambda at the
displacement eps_v h: below it friction is static.

Source: Li et al., "Incremental Potential Contact" (2020), section 5.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.contact.barrier.barrier_energy import predicted_forces
from supple.contact.barrier.friction_energy import (
    Slips,
    add_friction_gradient,
    friction_energy,
    friction_hessian,
    held_shares,
    renew_duals,
)
from supple.numerics.geometry.embedded_points import EmbeddedPoints, vertex_couplings
from supple.solvers.implicit.energies.potential import ContactPotential, HessianBlocks, Projection


class Press(NamedTuple):
    """What the largest forces of friction follow from: the barrier of k contacts where their normal forces are taken.

    Attributes
    ----------
    distances : (k,) gaps [m]; weights : (k,) mu kappa a [N]; dhat, soft : of the barrier [m]
    numbers : (k,) of the contacts among all at that state
    """

    distances: NDArray[np.float64]
    weights: NDArray[np.float64]
    dhat: float
    soft: float
    numbers: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Friction(ContactPotential):
    """Of contacts between points.

    Attributes
    ----------
    points : that `slips` refers to; reach : eps_v h [m], the displacement below which friction is static
    press : None where normal forces are not predicted
    duals : (k, 3) the state of a minimization, see `friction_energy`; zero at first: the step is that of the majorizer
    """

    points: EmbeddedPoints
    slips: Slips
    reach: float
    press: Press | None = None
    duals: NDArray[np.float64] = field(init=False)
    projection = Projection.UNNEEDED
    work = "friction"

    def __post_init__(self) -> None:
        object.__setattr__(self, "duals", np.zeros((len(self.slips.forces), 3)))

    def value(self, x: NDArray[np.float64]) -> float:
        return friction_energy(self.points.positions(x), self.slips, self.reach)

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        points = self.points.positions(x)
        forces = np.zeros_like(points)
        add_friction_gradient(points, self.slips, self.reach, forces)
        self.points.add_forces(forces, out)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        """The matrix of a primal-dual step, positive semi-definite without projection."""
        between = friction_hessian(self.points.positions(x), self.slips, self.reach, self.duals)
        out.couplings.append(vertex_couplings(self.points, between))

    def renew(self, x: NDArray[np.float64], direction: NDArray[np.float64]) -> None:
        positions = self.points.positions
        renew_duals(positions(x), positions(direction), self.slips, self.reach, self.duals)

    def settle(self, x: NDArray[np.float64]) -> None:
        """Set the duals to the forces at x (n, 3): the matrix is then the Hessian there."""
        self.duals[:] = self.held(x, np.zeros_like(x))

    def by_start(self, x: NDArray[np.float64], way: NDArray[np.float64]) -> NDArray[np.float64]:
        """(n, 3) the derivative of the gradient's product with `way` (n, 3) by where the step begins."""
        self.settle(x)
        points, out = self.points.positions, np.zeros_like(x)
        between = friction_hessian(points(x), self.slips, self.reach, self.duals)
        vertex_couplings(self.points, between).add_product(-way, out)
        return out

    def held(self, x: NDArray[np.float64], way: NDArray[np.float64]) -> NDArray[np.float64]:
        """(k, 3) what the linearization at x (n, 3) predicts at the end of a way (n, 3), as shares of the largest
        forces; along the slip."""
        positions = self.points.positions
        return held_shares(positions(x), positions(way), self.slips, self.reach)

    def predicted(self, way: NDArray[np.float64]) -> NDArray[np.float64]:
        """(k,) the largest forces at the end of a way (n, 3), as the barrier's linearization predicts [N]."""
        if self.press is None:
            return self.slips.forces
        s, moved = self.slips, self.points.positions(way)
        changes = np.einsum("ki,kij,kj->k", s.coefficients, moved[s.points], s.normals)
        distances, weights, dhat, soft, _ = self.press
        return predicted_forces(distances, changes, weights, dhat, soft)
