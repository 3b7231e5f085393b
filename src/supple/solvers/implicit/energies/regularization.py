"""Regularization of a static problem: a little stiffness in the Hessian, none in the energy.

Without inertia, a body that hangs on one vertex can turn at no cost, and its Hessian is singular. The stiffness changes
the directions of Newton's method, not the minimum.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.model.system import System
from supple.solvers.implicit.energies.potential import HessianBlocks, Potential, Projection

# Relative to the vertex's own elastic stiffness: far above its round-off (1e-16), and far below what slows Newton's
# method down.
_SHARE = 1e-8


@dataclass(frozen=True, eq=False)
class Regularization(Potential):
    """No energy, no force; stiffness : (n,) [N/m] on the diagonal of the projected Hessian."""

    stiffness: NDArray[np.float64]
    projection = Projection.RELEASED_FIRST

    def value(self, x: NDArray[np.float64]) -> float:
        return 0.0

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        """Zero."""

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        if project:
            for k in range(3):
                out.vertices[:, k, k] += self.stiffness


def regularization_of(system: System) -> Regularization:
    """In proportion to mu V |g|^2, summed over a vertex's tets, with shape gradients g."""
    mu = system.laws.material.mu
    squares = np.einsum("eij,eij->e", system.rest_shape_inverse, system.rest_shape_inverse)
    share = _SHARE * mu * system.rest_volumes * squares
    stiffness = np.bincount(system.tets.ravel(), weights=np.repeat(share, 4), minlength=len(system.rest_positions))
    stiffness = stiffness.astype(np.float64)
    if system.quadratic is not None:
        points = system.quadratic.quadrature
        squares = np.einsum("ks,ksai,ksai->ka", points.volumes, points.gradients, points.gradients)
        share = _SHARE * mu[system.quadratic.rows, None] * squares
        stiffness += np.bincount(points.nodes.ravel(), weights=share.ravel(), minlength=len(stiffness))
    if (shells := system.shells) is not None:
        squares = np.einsum("tpa,tpa->t", shells.gradients, shells.gradients)
        share = np.repeat(_SHARE * shells.mu * shells.thickness * shells.areas * squares, 3)
        stiffness += np.bincount(shells.triangles.ravel(), weights=share, minlength=len(stiffness))
    if (rods := system.rods) is not None:
        share = np.repeat(_SHARE * rods.section, 4)
        stiffness += np.bincount(rods.nodes.ravel(), weights=share, minlength=len(stiffness))
    return Regularization(stiffness)
