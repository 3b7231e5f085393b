"""Friction of one linearization, which holds no contact by more than Coulomb's law allows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.contact.barrier.friction_energy import friction_hessian
from supple.numerics.geometry.embedded_points import vertex_couplings
from supple.solvers.implicit.contact.friction import Friction
from supple.solvers.implicit.energies.potential import ContactPotential, HessianBlocks

# Of the largest force: what rounding and conjugate gradients may add to one that holds.
_EXCESS = 1e-3


@dataclass(frozen=True, eq=False)
class Sliding(ContactPotential):
    """What a linearization's friction lacks so that some contacts slide: they get their largest force, along the slip.

    Where friction is linearized, at a small slip u, its matrix is that of f / |u| or more in all directions: a force
    that grows with the way without a limit. A contact on which it would be larger than the largest force, of the normal
    force that the linear system predicts, gets that one as a constant, and no matrix. The energy does not count.

    Attributes
    ----------
    along : (k, 3) unit vectors of the slip of contacts that slide, zero for others; forces : (k,) on them [N]
    """

    friction: Friction
    along: NDArray[np.float64]
    forces: NDArray[np.float64]

    @classmethod
    def of(cls, friction: Friction) -> Sliding:
        """Nothing slides."""
        return cls(friction, np.zeros((len(friction.slips.forces), 3)), friction.slips.forces)

    @property
    def slides(self) -> NDArray[np.bool_]:
        """(k,) which contacts slide."""
        return np.asarray(self.along.any(axis=1))

    def with_more(self, x: NDArray[np.float64], way: NDArray[np.float64]) -> Sliding | None:
        """With the contacts that a `way` (n, 3) from x (n, 3) loads by too much; None if there are none."""
        friction = self.friction
        held, largest = friction.slips.forces[:, None] * friction.held(x, way), friction.predicted(way)
        sizes = np.linalg.norm(held, axis=1)
        more = (sizes > (1.0 + _EXCESS) * largest) & ~self.slides
        if not more.any():
            return None
        along = np.where(more[:, None], held / np.where(more, sizes, 1.0)[:, None], self.along)
        return Sliding(friction, along, largest)

    def renew(self, way: NDArray[np.float64]) -> None:
        """Let the largest forces of friction be those that were predicted for a way (n, 3)."""
        self.friction.slips.forces[:] = self.friction.predicted(way)

    def value(self, x: NDArray[np.float64]) -> float:
        return 0.0

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        friction, slides = self.friction, self.slides
        s, held = friction.slips, friction.held(x, np.zeros_like(x))
        lacks = self.forces[:, None] * self.along - s.forces[:, None] * held
        forces = np.zeros((len(friction.points), 3))
        np.add.at(forces, s.points[slides], (s.coefficients[:, :, None] * lacks[:, None])[slides])
        friction.points.add_forces(forces, out)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        slides = self.slides
        slips = self.friction.slips.where(slides)
        slips = slips._replace(forces=-slips.forces)
        points = self.friction.points
        between = friction_hessian(points.positions(x), slips, self.friction.reach, self.friction.duals[slides])
        out.couplings.append(vertex_couplings(points, between))
