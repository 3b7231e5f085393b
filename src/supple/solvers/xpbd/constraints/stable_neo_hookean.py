"""The stable Neo-Hookean constraint set: C_D = sqrt(tr F^T F), C_H = J - (1 + mu / lam), of each tet together.

With alpha_D = 1 / (mu V), alpha_H = 1 / (lam V) their energy is V (mu/2 Ic + lam/2 (J - 1 - mu/lam)^2): that of
`StableNeoHookean`, up to a constant. At rest neither constraint is zero; only the sum of their forces is. Projection
of one after the other leaves a residual that depends on the substep and makes the body too soft. Here both are
projected in one step, which is exactly zero at rest (derivation: docs/theory/xpbd.md, "The block of two").

Source of the constraints: Macklin and Müller, "A Constraint-based Formulation of Stable Neo-Hookean Materials" (2021).
"""

from __future__ import annotations

import logging
from typing import cast

import numpy as np
from numpy.typing import NDArray

from supple.materials.material import Elastic
from supple.model.system import BodyRange, System
from supple.solvers.xpbd.constraints.block_of_two import project_blocks_of_two
from supple.solvers.xpbd.sweeps.groups import Groups, make_groups
from supple.solvers.xpbd.sweeps.ordering import Layout
from supple.solvers.xpbd.sweeps.sweep import Sweep

logger = logging.getLogger(__name__)


class BlocksOfTwo:
    """Both constraints of any tetrahedra, in given groups.

    Parameters
    ----------
    tets : (m, 4); Dm_inv : (m, 3, 3) [1/m]; volumes : (m,) at rest [m^3]
    moduli : mu and lam of the energy density, (m,) each, above zero [Pa]
    inverse_masses : of all vertices [1/kg]
    groups : of the tets

    Attributes
    ----------
    warns : whether the log says that they are too stiff; it did before stitches broke
    """

    called = "stable Neo-Hookean tets"
    warns = True

    def __init__(
        self,
        tets: tuple[NDArray, NDArray, NDArray],
        moduli: tuple[NDArray, NDArray],
        inverse_masses: NDArray[np.float64],
        groups: Groups,
    ) -> None:
        (corners, Dm_inv, V), self._moduli = tets, moduli
        self.count = len(corners)
        # The projection of one of these tets costs about three times as much as that of an edge or a volume.
        self.work = 3 * self.count
        self._masses = inverse_masses[corners]
        self.sweep = Sweep(project_blocks_of_two, corners, self.constants(Dm_inv, V), groups)
        self._warned_for = 0.0

    def constants(self, Dm_inv: NDArray[np.float64], V: NDArray[np.float64]) -> NDArray[np.float64]:
        """(m, c) what the projection reads of each tet."""
        (mu, lam), w = self._moduli, self._masses
        gradients, curvatures = _principal_axes(Dm_inv, w)
        # The longest step, phi h^2, with which a tet cannot overshoot.
        self._longest = 1.0 / np.maximum(2.0 * mu * V * curvatures[:, 2], np.finfo(float).tiny)
        material = np.column_stack([mu * V, lam * V, 1.0 + mu / lam, self._longest])
        return np.hstack([gradients.reshape(-1, 9), material, curvatures, w])

    def project(self, points: NDArray[np.float64], h: float) -> None:
        """See `ConstraintSet.project`."""
        if self.warns and h != self._warned_for:
            self._warn_if_shortened(h)
        self.sweep.run(points, h)

    def _warn_if_shortened(self, h: float) -> None:
        self._warned_for = h
        stiffness = h**2 / self._longest
        shortened = np.count_nonzero(stiffness > 1.0) / self.count
        if shortened > 0.5:
            logger.warning(
                "XPBD: %.0f %% of the %s are too stiff, or too light, for substeps of %.3g s and "
                "act softer than they are; about %.3g times as many substeps give them their stiffness",
                100.0 * shortened,
                self.called,
                h,
                np.sqrt(np.quantile(stiffness, 0.9)),
            )


class StableNeoHookeanConstraints(BlocksOfTwo):
    """The tetrahedra of all bodies made of `StableNeoHookean`."""

    def __init__(self, system: System, parts: list[BodyRange], layout: Layout) -> None:
        materials = [cast(Elastic, part.body.material).per_tet(part.tets.stop - part.tets.start) for part in parts]
        rows = np.concatenate([np.arange(part.tets.start, part.tets.stop) for part in parts])
        mu = np.concatenate([material.mu for material in materials])
        lam = np.concatenate([material.lam for material in materials])  # E / (2 (1 + nu) (1 - 2 nu)): above zero
        movable = (system.inverse_masses[system.tets[rows]] > 0.0).any(axis=1)
        rows, mu, lam = rows[movable], mu[movable], lam[movable]
        tets = system.tets[rows], system.rest_shape_inverse[rows], system.rest_volumes[rows]
        self._rows = rows
        super().__init__(tets, (mu, lam), system.inverse_masses, make_groups(layout, tets[0]))
        self.warns = len(system.stitching.broken) == 0

    def grow(self, Dm_inv: NDArray[np.float64], volumes: NDArray[np.float64]) -> None:
        """Take other stress-free shapes of all tets of the system: (m, 3, 3) [1/m], (m,) [m^3]."""
        self.sweep.change(self.constants(Dm_inv[self._rows], volumes[self._rows]))


def _principal_axes(
    Dm_inv: NDArray[np.float64], w: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Shape gradients in the axes in which sum_i w_i b_i b_i^T is diagonal, and that diagonal.

    The energy is isotropic, so each tet may have its own rest coordinates. In these the matrix that couples the two
    constraints is diagonal: three numbers instead of six.
    """
    b = np.concatenate([-Dm_inv.sum(axis=1, keepdims=True), Dm_inv], axis=1)
    curvatures, axes = np.linalg.eigh(np.einsum("tn,tni,tnj->tij", w, b, b))
    axes[np.linalg.det(axes) < 0.0, :, 0] *= -1.0  # rotations only: a reflection would change the sign of J
    return Dm_inv @ axes, np.maximum(curvatures, 0.0)
