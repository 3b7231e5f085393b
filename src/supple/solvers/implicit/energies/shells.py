"""The energy of shells, and their damping: stretches of triangles, and angles of hinges.

Bending couples all hinges of a shell: its Hessian J^T W^-1 J is full. The sum of J^T P J over triangles is not below
it (`ShellElements.bounds`); that is added to the matrix, and the difference follows as a `Correction`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from supple.materials.shells.elements import ShellElements
from supple.materials.shells.hinges import Bent
from supple.materials.shells.membrane import strains, tension_only
from supple.numerics.sparse.couplings import Couplings
from supple.solvers.implicit.energies.damping import StrainRate
from supple.solvers.implicit.energies.potential import HessianBlocks, JointlyEvaluated, Projection

Floats = NDArray[np.float64]
_PAIRS = np.triu_indices(3), np.triu_indices(6), np.triu_indices(4)  # of corners, nodes of a stencil, and of a hinge


@dataclass(frozen=True, eq=False)
class HingeCorrection:
    """J^T (s W^-1 - P) J of hinges, which is not above zero; scale : (e,) s, the same for all hinges of a shell."""

    shells: ShellElements
    jacobian: csr_array
    scale: Floats

    def add_product(self, x: Floats, out: Floats) -> None:
        """Add the product with x (n, 3) to `out` (n, 3)."""
        turned, hinge_of = self.jacobian @ x.ravel(), self.shells.hinge_of
        own = np.where(hinge_of < 0, 0.0, turned[hinge_of])
        bound = np.einsum("tab,tb->ta", self.shells.bounds, own)
        bounds = np.bincount(hinge_of[hinge_of >= 0], bound[hinge_of >= 0], len(turned))
        out += (self.jacobian.T @ (self.scale * (self.shells.moments(turned) - bounds))).reshape(out.shape)


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
        turned = Bent(x, shells.hinges).angles - self._angles
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
        forces = np.einsum("t,tia,tab,tpb->tpi", volumes, F, full, shells.gradients)
        bent = Bent(x, shells.hinges)
        turned, turns = bent.angles - self._angles, bent.gradients()
        moments = self._scale * shells.moments(turned)
        corners = np.concatenate([shells.triangles.ravel(), shells.hinges.ravel()])
        pushes = np.concatenate([forces.reshape(-1, 3), (moments[:, None, None] * turns).reshape(-1, 3)])
        for k in range(3):
            gradient[:, k] += np.bincount(corners, pushes[:, k], len(x))
        if hessian is not None:
            kept = tension_only(S)[:, [0, 2, 2, 1]].reshape(-1, 2, 2) if project else full
            hessian.patches.append(self._stretching(F, volumes, kept, tangents))
            hessian.patches.append(self._bending(turns))
            if not project:
                hessian.patches.append(self._turning(moments, bent.hessians()))
            if len(turned):
                hessian.corrections.append(HingeCorrection(shells, shells.jacobian(turns, len(x)), self._scale))
        return float(volumes @ self._densities(E)) + 0.5 * float(turned @ moments)

    def _stretching(self, F: Floats, volumes: Floats, S: Floats, tangents: Floats) -> Couplings:
        """V (B_p^T D B_q + (g_p . S g_q) 1), B_p the strains of corner p, D the tangents."""
        g, (p, q) = self.shells.gradients, _PAIRS[0]
        first, second = F[:, None, :, 0], F[:, None, :, 1]
        B = np.stack([first * g[:, :, :1], second * g[:, :, 1:], first * g[:, :, 1:] + second * g[:, :, :1]], axis=2)
        blocks = np.einsum("tpai,tab,tpbj->tpij", B[:, p], volumes[:, None, None] * tangents, B[:, q], optimize=True)
        along = np.einsum("tpa,tab,tpb->tp", g[:, p], volumes[:, None, None] * S, g[:, q], optimize=True)
        blocks += along[:, :, None, None] * np.eye(3)
        triangles = self.shells.triangles
        return _couplings(triangles[:, p], triangles[:, q], blocks)

    def _bending(self, turns: Floats) -> Couplings:
        """J^T P J."""
        shells, (p, q) = self.shells, _PAIRS[1]
        (nodes, places), has = shells.stencils, shells.hinge_of >= 0
        own = np.zeros((len(nodes), 3, 6, 3))
        for k in range(3):
            rows = np.flatnonzero(has[:, k])
            hinge = shells.hinge_of[rows, k]
            own[rows[:, None], k, places[rows, k]] = self._scale[hinge, None, None] ** 0.5 * turns[hinge]
        flat = own.reshape(-1, 3, 18)
        full = (np.swapaxes(flat, 1, 2) @ (shells.bounds @ flat)).reshape(-1, 6, 3, 6, 3)
        blocks = full[:, p, :, q].transpose(1, 0, 2, 3)
        return _couplings(nodes[:, p], nodes[:, q], blocks)

    def _turning(self, moments: Floats, curls: Floats) -> Couplings:
        """sum m_e d^2 theta_e."""
        hinges, (p, q) = self.shells.hinges, _PAIRS[2]
        return _couplings(hinges[:, p], hinges[:, q], moments[:, None, None, None] * curls[:, p, q])


def _couplings(rows: NDArray[np.int32], columns: NDArray[np.int32], blocks: Floats) -> Couplings:
    """Of pairs (k, c) of nodes, -1 for none, with blocks (k, c, 3, 3); two nodes of an element may be one vertex."""
    p, q = next(pair for pair in _PAIRS if len(pair[0]) == rows.shape[1])
    twice = (rows == columns) & (p != q)
    blocks[twice] += np.swapaxes(blocks[twice], 1, 2)
    kept = (rows >= 0) & (columns >= 0)
    return Couplings(rows[kept], columns[kept], blocks[kept])


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
        bent = Bent(x, self.shells.hinges).angles
        return np.concatenate([strains(self.shells.deformation_gradients(x)).ravel(), bent])

    def damping(self, rate: StrainRate) -> ShellDamping:
        """The dissipation potential of one step."""
        return ShellDamping(self.shells, rate)
