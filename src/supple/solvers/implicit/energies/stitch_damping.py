"""Kelvin-Voigt damping of stitches: tets as those of bodies, springs by the rate of their length."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from supple.scene.stitches.elements import Springs
from supple.scene.stitches.stitching import Stitching
from supple.solvers.implicit.energies.damping import Damping, QuadraticViscosity, StrainRate, Viscosity
from supple.solvers.implicit.energies.potential import HessianBlocks, Potential, Projection
from supple.solvers.implicit.energies.rods import RodViscosity
from supple.solvers.implicit.energies.shells import ShellViscosity
from supple.solvers.implicit.energies.stitches import spring_energies, spring_gradients, spring_hessians
from supple.solvers.implicit.energies.tet_elements import TetElements


@dataclass(frozen=True, eq=False)
class StitchViscosity:
    """The damped stitches of a system.

    Attributes
    ----------
    tets : their viscosity; springs : those with damping, `stiffness` times tau instead of the stiffness [N s/m]
    """

    tets: Viscosity
    springs: Springs

    @classmethod
    def of(cls, stitching: Stitching) -> StitchViscosity | None:
        """None where no stitch is damped."""
        tets, springs = stitching.tets, stitching.springs
        if not tets.damping.any() and not springs.damping.any():
            return None
        arrays = tets.vertices, tets.rest_shape_inverse, tets.rest_volumes
        elements = TetElements.of(*arrays, stitching.body_vertices)
        # The Lamé parameters of small strains; the viscous bulk modulus is not below zero.
        mu, lam = tets.mu, np.maximum(tets.lam - tets.mu, -2.0 / 3.0 * tets.mu)
        viscosity = Viscosity(elements, tets.damping * mu, tets.damping * lam)
        return cls(viscosity, replace(springs, stiffness=springs.stiffness * springs.damping))

    def strains(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Green strains of the tets, and lengths of the springs, one after the other (6 k + s,)."""
        lengths = np.linalg.norm(self.springs.extensions(x), axis=1)
        return np.concatenate([self.tets.strains(x).ravel(), lengths])

    def damping(self, rate: StrainRate) -> StitchDamping:
        """The dissipation potential of one step, with the rates of `strains`."""
        count = 6 * len(self.tets.mu)
        tets = StrainRate(rate.factor, np.ascontiguousarray(rate.reference[:count].reshape(-1, 6)))
        stiffness = rate.factor * self.springs.stiffness
        springs = replace(self.springs, stiffness=stiffness, rest_lengths=rate.reference[count:])
        return StitchDamping(Damping(self.tets, tets), springs)


Damper = Viscosity | QuadraticViscosity | StitchViscosity | ShellViscosity | RodViscosity


@dataclass(frozen=True, eq=False)
class StitchDamping(Potential):
    """The dissipation potential of one step; for a spring, k tau c/2 (length - reference)^2."""

    tets: Damping
    springs: Springs
    projection = Projection.RELEASED_FIRST
    work = "damping"

    def value(self, x: NDArray[np.float64]) -> float:
        return self.tets.value(x) + float(spring_energies(self.springs, x).sum())

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        self.tets.add_gradient(x, out)
        gradients = np.empty((len(self.springs), 4, 3))
        spring_gradients(self.springs, x, gradients)
        np.add.at(out, self.springs.vertices, gradients[:, :3])

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        count = len(self.tets.viscosity.mu)
        self.tets.add_hessian(x, HessianBlocks(out.stitches[:count], out.vertices, count), project)
        blocks = np.empty((len(self.springs), 12, 12))
        spring_hessians(self.springs, x, project, blocks)
        out.stitches[count:] += blocks
