"""Kelvin-Voigt damping of the strain rate, as a potential of the positions at the end of a step.

With the Green strain E(F) = (F^T F - I)/2 and a rate E' = c (E(F) - E^), the dissipation potential of a tet is

    D = V tau / (2 c) E' : C : E',    C : E = 2 mu_L E + lam_L tr(E) I,

whose gradient by x is the force of the viscous stress tau C : E'. For backward Euler c = 1/h and E^ is the strain at
the start of the step; other integrators choose c and E^ as they choose the velocity. The strain does not change in a
rigid motion of any size, so that a spinning body keeps spinning. (The quadratic form of the lagged stiffness matrix,
which is often used, takes the chord of a rotation for a compression, and damps the rotation.)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.materials.isotropic import rest_lame_parameters
from supple.materials.stretch_energies.stretches import green_strain
from supple.materials.tet_energies import deformation_gradient, edge_matrix, put_gradient
from supple.numerics.mat3 import load_mat, mat_mul, mat_mul_transposed
from supple.runtime.kernel_cache import njit, prange
from supple.solvers.implicit.energies.elasticity import Elasticity
from supple.solvers.implicit.energies.potential import Potential
from supple.solvers.implicit.energies.quadratic.term import OfQuadraticTets, VirtualTets
from supple.solvers.implicit.energies.tet_elements import TetElements, TetPotential


@dataclass(frozen=True, eq=False)
class StrainRate:
    """The strain rate at the end of a step, factor (E - reference); reference : (m, 6) xx yy zz yz xz xy."""

    factor: float
    reference: NDArray[np.float64]


@njit
def _stress(F, reference, e, factor, mu, lam):
    """The viscous second Piola-Kirchhoff stress of tet e, and its strain rate times that, halved and divided by c."""
    E = green_strain(F)
    r0 = factor * (E[0] - reference[e, 0])
    r1 = factor * (E[1] - reference[e, 1])
    r2 = factor * (E[2] - reference[e, 2])
    r3 = factor * (E[3] - reference[e, 3])
    r4 = factor * (E[4] - reference[e, 4])
    r5 = factor * (E[5] - reference[e, 5])
    t = lam * (r0 + r1 + r2)
    m = 2.0 * mu
    S = (m * r0 + t, m * r1 + t, m * r2 + t, m * r3, m * r4, m * r5)
    power = S[0] * r0 + S[1] * r1 + S[2] * r2 + 2.0 * (S[3] * r3 + S[4] * r4 + S[5] * r5)
    return S, 0.5 * power / factor


@njit
def _full(S):
    return (S[0], S[5], S[4], S[5], S[1], S[3], S[4], S[3], S[2])


@njit(cache=True)
def _strains(x, tets, Dm_inv, out):
    for e in range(len(tets)):
        E = green_strain(deformation_gradient(x, tets, Dm_inv, e))
        for k in range(6):
            out[e, k] = E[k]


@njit(cache=True, parallel=True)
def _energies(x, tets, Dm_inv, volumes, mu, lam, factor, reference, out):
    for e in prange(len(tets)):
        F = deformation_gradient(x, tets, Dm_inv, e)
        out[e] = volumes[e] * _stress(F, reference, e, factor, mu[e], lam[e])[1]


@njit(cache=True, parallel=True)
def _gradients(x, tets, Dm_inv, volumes, mu, lam, factor, reference, out):
    for e in prange(len(tets)):
        B = load_mat(Dm_inv, e)
        F = mat_mul(edge_matrix(x, tets, e), B)
        S = _full(_stress(F, reference, e, factor, mu[e], lam[e])[0])
        put_gradient(mat_mul(F, S), B, volumes[e], out, e)


@njit(cache=True, parallel=True)
def _hessians(x, tets, Dm_inv, volumes, mu, lam, factor, reference, project, out):
    """d^2 D / dx_p dx_q = c V (dE/dx_p) C (dE/dx_q) + V (g_p . S g_q) I, with shape gradients g.

    With a = F g_p, g = g_p and b = F g_q, h = g_q: dE = sym(g (x) F^T ...) gives the block
    c V [ lam a b^T + mu ((g . h) F F^T + b a^T ) ]; the second term, of the stress, is left out by `project`.
    """
    for e in prange(len(tets)):
        if mu[e] == 0.0 and lam[e] == 0.0:
            continue
        B = load_mat(Dm_inv, e)
        F = mat_mul(edge_matrix(x, tets, e), B)
        S = _full(_stress(F, reference, e, factor, mu[e], lam[e])[0])
        FFt = mat_mul_transposed(F, F)
        g = np.empty((4, 3))
        a = np.empty((4, 3))
        for k in range(3):
            g[0, k] = -(B[k] + B[3 + k] + B[6 + k])
            g[1, k], g[2, k], g[3, k] = B[k], B[3 + k], B[6 + k]
        for p in range(4):
            for i in range(3):
                a[p, i] = F[3 * i] * g[p, 0] + F[3 * i + 1] * g[p, 1] + F[3 * i + 2] * g[p, 2]
        c = factor * volumes[e]
        for p in range(4):
            for q in range(4):
                gh = g[p, 0] * g[q, 0] + g[p, 1] * g[q, 1] + g[p, 2] * g[q, 2]
                stress = 0.0
                if not project:
                    for i in range(3):
                        for j in range(3):
                            stress += g[p, i] * S[3 * i + j] * g[q, j]
                    stress *= volumes[e]
                for i in range(3):
                    for j in range(3):
                        value = lam[e] * a[p, i] * a[q, j] + mu[e] * (gh * FFt[3 * i + j] + a[q, i] * a[p, j])
                        out[e, 3 * p + i, 3 * q + j] += c * value + (stress if i == j else 0.0)


@dataclass(frozen=True, eq=False)
class Damping(TetPotential):
    """The dissipation potential of one step.

    With `project`, the Hessian is without the term of the viscous stress: what remains is positive semi-definite
    (Gauss-Newton).
    """

    viscosity: Viscosity
    rate: StrainRate
    work = "damping"
    kernels = _energies, _gradients, _hessians

    @property
    def elements(self) -> TetElements:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.viscosity.elements

    @property
    def parameters(self) -> tuple[Any, ...]:
        volumes = self.viscosity.elements.rest_volumes
        return volumes, self.viscosity.mu, self.viscosity.lam, self.rate.factor, self.rate.reference


@dataclass(frozen=True, eq=False)
class Viscosity:
    """Viscous moduli of every tet.

    Attributes
    ----------
    mu, lam : (m,) tau times the Lamé parameters of the material's linearization at rest [Pa s]
    """

    elements: TetElements
    mu: NDArray[np.float64]
    lam: NDArray[np.float64]

    def strains(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(m, 6) Green strain of every tet at positions x."""
        out = np.empty((len(self.elements), 6))
        _strains(x, self.elements.tets, self.elements.rest_shape_inverse, out)
        return out

    def damping(self, rate: StrainRate) -> Potential:
        """The dissipation potential of one step."""
        return Damping(self, rate)


def viscosity_of(elasticity: Elasticity) -> Viscosity | None:
    """The viscosity of a system's linear tets; None where no material is damped."""
    tau = elasticity.material.damping
    if elasticity.quadratic is not None:
        tau = tau.copy()
        tau[elasticity.quadratic.rows] = 0.0
    if not tau.any():
        return None
    # At the points of quadratic tets, without the part of the mean volume: it would lock them.
    mu, lam = rest_lame_parameters(elasticity.material)
    return Viscosity(elasticity.elements, tau * mu, tau * lam)


@dataclass(frozen=True, eq=False)
class QuadraticViscosity:
    """The viscosity at the quadrature points of quadratic tets, under the names of `Viscosity`."""

    virtual: VirtualTets
    inner: Viscosity

    def strains(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(m, 6) Green strain at every point."""
        return self.inner.strains(self.virtual.corners(x))

    def damping(self, rate: StrainRate) -> Potential:
        """The dissipation potential of one step."""
        return OfQuadraticTets(Damping(self.inner, rate), self.virtual)


def quadratic_viscosity_of(elasticity: Elasticity) -> QuadraticViscosity | None:
    """The viscosity of a system's quadratic tets; None where no material is damped."""
    quadratic = elasticity.quadratic
    inner = None if quadratic is None else viscosity_of(quadratic.inner)
    return None if quadratic is None or inner is None else QuadraticViscosity(quadratic.virtual, inner)
