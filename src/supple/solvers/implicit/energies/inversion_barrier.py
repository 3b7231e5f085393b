"""A barrier against inversion, for materials that have none: it acts only on tets that have lost most of their volume.

Stable Neo-Hookean and the corotated materials have a finite energy at J = 0: pressed hard enough, the minimum of their
energy lies beyond inversion, and a step filter alone would stop Newton's method in front of it without a minimum to
converge to. With y = J / J0 and the onset J0,

    B = V kappa b(y),    b(y) = -(y - 1)^2 ln y for y < 1, else 0,    kappa = J0 (mu + lam),

the minimum exists again. b has two continuous derivatives. It is zero for a tet with J >= J0.

Source of b: Li et al., "Incremental Potential Contact" (2020), equation 6, with the volume in place of the distance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.materials.kinds import infinite_when_flat
from supple.materials.tet_energies import deformation_gradient, edge_matrix, put_gradient
from supple.numerics.mat3 import cross, det, dot, load_mat
from supple.runtime.kernel_cache import njit, prange
from supple.solvers.implicit.energies.elasticity import Elasticity
from supple.solvers.implicit.energies.potential import HessianBlocks
from supple.solvers.implicit.energies.quadratic.bernstein_barrier import barrier_derivatives
from supple.solvers.implicit.energies.tet_elements import TetElements, TetPotential


@njit
def _volume_ratio(x, tets, Dm_inv, e):
    """J of tet e."""
    return det(edge_matrix(x, tets, e)) * det(load_mat(Dm_inv, e))


@njit(cache=True, parallel=True)
def _energies(x, tets, Dm_inv, stiffness, onset, out):
    for e in prange(len(tets)):
        out[e] = 0.0
        if stiffness[e] > 0.0:
            out[e] = stiffness[e] * barrier_derivatives(_volume_ratio(x, tets, Dm_inv, e), onset)[0]


@njit(cache=True, parallel=True)
def _gradients(x, tets, Dm_inv, stiffness, onset, out):
    for e in prange(len(tets)):
        _, first, _ = barrier_derivatives(_volume_ratio(x, tets, Dm_inv, e), onset)
        C = _cofactors(deformation_gradient(x, tets, Dm_inv, e))
        f = first * stiffness[e]
        P = (f * C[0], f * C[1], f * C[2], f * C[3], f * C[4], f * C[5], f * C[6], f * C[7], f * C[8])
        put_gradient(P, load_mat(Dm_inv, e), 1.0, out, e)


@njit(cache=True, parallel=True)
def _hessians(x, tets, Dm_inv, stiffness, onset, project, out):
    """For nodes p and q with shape gradients g and h: b'' (C g)(C h)^T + b' [F (g x h)]_x, C the cofactors of F."""
    for e in prange(len(tets)):
        _, first, second = barrier_derivatives(_volume_ratio(x, tets, Dm_inv, e), onset)
        if stiffness[e] == 0.0 or second == 0.0:
            continue
        F, B = deformation_gradient(x, tets, Dm_inv, e), load_mat(Dm_inv, e)
        C = _cofactors(F)
        g = (-(B[0] + B[3] + B[6]), -(B[1] + B[4] + B[7]), -(B[2] + B[5] + B[8])), B[:3], B[3:6], B[6:]
        for p in range(4):
            a = _times(C, g[p])
            for q in range(4):
                b = _times(C, g[q])
                c = _times(F, cross(g[p], g[q]))
                turn = (0.0, c[2], -c[1], -c[2], 0.0, c[0], c[1], -c[0], 0.0)
                for i in range(3):
                    for j in range(3):
                        value = second * a[i] * b[j]
                        if not project:
                            value += first * turn[3 * i + j]
                        out[e, 3 * p + i, 3 * q + j] += stiffness[e] * value


@njit
def _cofactors(F):
    """d J / d F, nine numbers."""
    a, b, c = cross(F[3:6], F[6:]), cross(F[6:], F[:3]), cross(F[:3], F[3:6])
    return (a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2])


@njit(cache=True)
def _times(A, v):
    return (dot(A[:3], v), dot(A[3:6], v), dot(A[6:], v))


@dataclass(frozen=True, eq=False)
class InversionBarrier(TetPotential):
    """The barrier of the tets that have a stiffness here.

    With `project`, the Hessian is without the term of the second derivative of J, whose factor is negative.

    Attributes
    ----------
    stiffness : (m,) kappa V [J], zero for tets without a barrier
    onset : J0 [-]
    """

    elements: TetElements
    stiffness: NDArray[np.float64]
    onset: float
    kernels = _energies, _gradients, _hessians

    @property
    def parameters(self) -> tuple[NDArray[np.float64], float]:
        return self.stiffness, self.onset

    def add_model(
        self, x: NDArray[np.float64], gradient: NDArray[np.float64], hessian: HessianBlocks | None, project: bool
    ) -> float:
        """See `Potential.add_model`; most often no tet is below the onset, and the energy alone shows that."""
        energy = self.value(x)
        if energy:
            self.add_gradient(x, gradient)
            if hessian is not None:
                self.add_hessian(x, hessian, project)
        return energy


def inversion_barrier(elasticity: Elasticity, guarded: NDArray[np.bool_], onset: float) -> InversionBarrier | None:
    """The barrier below J = `onset` of the guarded tets whose energy has none; None where no such tet exists."""
    material = elasticity.material
    if elasticity.quadratic is not None:
        guarded = guarded.copy()
        guarded[elasticity.quadratic.rows] = False
    wanted = guarded & ~infinite_when_flat(material)
    if not wanted.any():
        return None
    kappa = onset * (material.mu + np.abs(material.lam))
    elements = elasticity.elements
    return InversionBarrier(elements, np.where(wanted, kappa * elements.rest_volumes, 0.0), onset)
