"""Kelvin-Voigt damping of stitches: tets as those of bodies, springs by the rate of their length."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from supple.numerics.sparse.block_csr import incidences
from supple.scene.stitches.elements import Springs
from supple.scene.stitches.stitching import Stitching
from supple.solvers.implicit.energies.damping import Damping, StrainRate, Viscosity
from supple.solvers.implicit.energies.elasticity import Elasticity
from supple.solvers.implicit.energies.potential import HessianBlocks, Potential, Projection
from supple.solvers.implicit.energies.stitches import spring_energies, spring_gradients, spring_hessians


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
        # Stitch tets under the names of a system's tets.
        elements: Any = SimpleNamespace(
            tets=tets.vertices, rest_shape_inverse=tets.rest_shape_inverse, rest_volumes=tets.rest_volumes
        )
        gathering = incidences(tets.vertices, stitching.body_vertices)
        elasticity = Elasticity(elements, cast(Any, None), *gathering)
        # The Lamé parameters of small strains; the viscous bulk modulus is not below zero.
        mu, lam = tets.mu, np.maximum(tets.lam - tets.mu, -2.0 / 3.0 * tets.mu)
        viscosity = Viscosity(elasticity, tets.damping * mu, tets.damping * lam)
        return cls(viscosity, replace(springs, stiffness=springs.stiffness * springs.damping))

    def strains(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Green strains of the tets, and lengths of the springs, one after the other (6 k + s,)."""
        lengths = np.linalg.norm(self.springs.extensions(x), axis=1)
        return np.concatenate([self.tets.strains(x).ravel(), lengths])

    def strain_rates(self, x: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
        """Their rates at positions x moving with v [1/s], [m/s]."""
        d = self.springs.extensions(x)
        lengths = np.linalg.norm(d, axis=1)
        along = np.einsum("ki,ki->k", d, self.springs.extensions(v)) / np.where(lengths > 0.0, lengths, 1.0)
        return np.concatenate([self.tets.strain_rates(x, v).ravel(), along])


@dataclass(frozen=True, eq=False)
class StitchDamping(Potential):
    """The dissipation potential of one step; for a spring, k tau c/2 (length - reference)^2."""

    tets: Damping
    springs: Springs
    projection = Projection.RELEASED_FIRST
    work = "damping"

    @classmethod
    def of(cls, viscosity: StitchViscosity, rate: StrainRate) -> StitchDamping:
        """With the rates of `viscosity.strains`."""
        count = 6 * len(viscosity.tets.mu)
        tets = StrainRate(rate.factor, np.ascontiguousarray(rate.reference[:count].reshape(-1, 6)))
        springs = replace(
            viscosity.springs,
            stiffness=rate.factor * viscosity.springs.stiffness,
            rest_lengths=rate.reference[count:],
        )
        return cls(Damping(viscosity.tets, tets), springs)

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
