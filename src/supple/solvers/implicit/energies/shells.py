"""The energy of shells, and their damping: stretches of triangles, and angles of hinges.

Bending couples all hinges of a shell: its Hessian J^T W^-1 J is full. The sum of J^T P J over triangles is not below
it (`ShellElements.bounds`); that is added to the matrix, and the difference follows as a `Correction`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.materials.shells.elements import ShellElements
from supple.materials.shells.hinges import (
    add_bending,
    add_hinge_forces,
    add_turning,
    angles_of,
    hinge_products,
    subtract_bounds,
    turns_of,
)
from supple.materials.shells.membrane import add_stretching, strains, tension_only
from supple.numerics.sparse.couplings import Couplings
from supple.solvers.implicit.energies.damping import StrainRate
from supple.solvers.implicit.energies.potential import HessianBlocks, JointlyEvaluated, Projection

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class HingeCorrection:
    """J^T (s W^-1 - P) J of hinges, which is not above zero.

    Attributes
    ----------
    turns : (e, 4, 3) J; scale : (e,) s, the same for all hinges of a shell
    """

    shells: ShellElements
    turns: Floats
    scale: Floats

    def add_product(self, x: Floats, out: Floats) -> None:
        """Add the product with x (n, 3) to `out` (n, 3)."""
        shells, turned = self.shells, np.empty(len(self.turns))
        hinge_products(self.turns, shells.hinges, x, turned)
        moments = shells.moments(turned)
        subtract_bounds(shells.hinge_of, shells.bounds, turned, moments)
        add_hinge_forces(self.turns, shells.hinges, self.scale * moments, out)


@dataclass(frozen=True, eq=False)
class ShellEnergy(JointlyEvaluated):
    """The elastic energy of all shells."""

    shells: ShellElements
    label = "elasticity"
    projection = Projection.RELEASED_FIRST

    @property
    def _angles(self) -> Floats:
        """(e,) at which no moment acts [rad]."""
        return self.shells.rest_angles

    @property
    def _scale(self) -> Floats:
        """(e,) factor of moments."""
        return np.ones(len(self.shells.hinges))

    def _densities(self, E: Floats) -> Floats:
        return self.shells.densities(E)

    def _stresses(self, E: Floats) -> tuple[Floats, Floats]:
        return self.shells.stresses(E)

    def value(self, x: Floats) -> float:
        shells = self.shells
        turned = angles_of(x, shells.hinges) - self._angles
        stretched = self._densities(strains(shells.deformation_gradients(x)))
        bent = 0.5 * float((self._scale * turned) @ shells.moments(turned))
        total = float((shells.areas * shells.thickness) @ stretched) + bent
        return total if np.isfinite(total) else np.inf

    def add_model(self, x: Floats, gradient: Floats, hessian: HessianBlocks | None, project: bool) -> float:
        """See `Potential.add_model`; with `project`, compressed triangles do not buckle, and hinges turn straight."""
        shells = self.shells
        volumes = shells.areas * shells.thickness
        F = shells.deformation_gradients(x)
        E = strains(F)
        S, tangents = self._stresses(E)
        full = S[:, [0, 2, 2, 1]].reshape(-1, 2, 2)
        forces = np.einsum("tia,tpa->tpi", F @ (volumes[:, None, None] * full), shells.gradients)
        turned, turns = angles_of(x, shells.hinges) - self._angles, turns_of(x, shells.hinges)
        moments = self._scale * shells.moments(turned)
        for k in range(3):
            gradient[:, k] += np.bincount(shells.triangles.ravel(), forces[:, :, k].ravel(), len(x))
        if len(turned):
            add_hinge_forces(turns, shells.hinges, moments, gradient)
        if hessian is not None:
            rows, columns, twice = shells.pairs
            blocks = np.zeros((len(rows), 3, 3))
            add_stretching(F, shells.gradients, volumes, tension_only(S) if project else S, tangents, blocks)
            if len(turned):
                add_bending(shells.hinge_of, shells.stencils[1], shells.bounds, self._scale, turns, blocks)
                hessian.corrections.append(HingeCorrection(shells, turns, self._scale))
                if not project:
                    add_turning(x, shells.hinges, shells.hinge_of, shells.owned, shells.stencils[1], moments, blocks)
            blocks[twice] += np.swapaxes(blocks[twice], 1, 2)
            hessian.patches.append(Couplings(rows, columns, blocks))
        return float(volumes @ self._densities(E)) + 0.5 * float(turned @ moments)


@dataclass(frozen=True, eq=False)
class ShellDamping(ShellEnergy):
    """The dissipation potential of one step, Kelvin-Voigt as that of tets: see `damping`."""

    rate: StrainRate
    work = "damping"

    @property
    def _angles(self) -> Floats:
        return self.rate.reference[3 * len(self.shells.triangles) :]

    @property
    def _scale(self) -> Floats:
        return self.rate.factor * self.shells.hinge_damping

    def _densities(self, E: Floats) -> Floats:
        change = E - self._strains
        return 0.5 * self._factors * np.einsum("ta,tab,tb->t", change, self.shells.tangents, change)

    def _stresses(self, E: Floats) -> tuple[Floats, Floats]:
        tangents = self._factors[:, None, None] * self.shells.tangents
        return np.einsum("tab,tb->ta", tangents, E - self._strains), tangents

    @property
    def _factors(self) -> Floats:
        return self.rate.factor * self.shells.damping

    @property
    def _strains(self) -> Floats:
        return self.rate.reference[: 3 * len(self.shells.triangles)].reshape(-1, 3)


@dataclass(frozen=True, eq=False)
class ShellViscosity:
    """The viscosity of shells, under the names of `Viscosity`."""

    shells: ShellElements

    @classmethod
    def of(cls, shells: ShellElements | None) -> ShellViscosity | None:
        """None where no shell is damped."""
        return None if shells is None or not shells.damping.any() else cls(shells)

    def strains(self, x: Floats) -> Floats:
        """Strains of the triangles, then angles of the hinges, (3 t + e,)."""
        bent = angles_of(x, self.shells.hinges)
        return np.concatenate([strains(self.shells.deformation_gradients(x)).ravel(), bent])

    def damping(self, rate: StrainRate) -> ShellDamping:
        """The dissipation potential of one step."""
        return ShellDamping(self.shells, rate)
