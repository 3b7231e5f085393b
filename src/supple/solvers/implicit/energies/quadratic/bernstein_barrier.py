"""A barrier against inversion everywhere in a quadratic tet, on the Bernstein coefficients of its determinant.

The material's energy is evaluated at four points, and its own barrier, where it has one, acts only there: J would
reach zero between them. With the 20 coefficients c of the determinant (`numerics.quadratic_tets.bernstein`), those at
rest C, y = c / (J0 C) and the onset J0,

    B = V kappa / 20 sum b(y),    b(y) = -(y - 1)^2 ln y for y < 1, else 0,    kappa = J0 (mu + |lam|),

is infinite before J is zero anywhere: J lies between the smallest and the largest c / C where the element is straight
at rest. It is zero where all coefficients are above J0 C. For a constant F it is the barrier of linear tets.

A coefficient is the mean of det[D_1^a, D_2^b, D_3^c] over the arrangements (a, b, c) of its corners, where the
derivatives D are linear in the nodes: D_k^a = sum_n g_nk^a x_n. With u, v, w for the three columns, the gradient by x_n
is g_n1^a v x w + g_n2^b w x u + g_n3^c u x v, and the second derivative by x_n and x_m is the cross-product matrix of

    (g_n1 g_m2 - g_n2 g_m1) w + (g_n2 g_m3 - g_n3 g_m2) u + (g_n3 g_m1 - g_n1 g_m3) v.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.numerics.bernstein import COUNT, TERM, TERMS, corner_derivatives, determinant_coefficients
from supple.numerics.quadratic_shape_functions import reference_gradients
from supple.numerics.sparse.couplings import Couplings
from supple.runtime.kernel_cache import njit
from supple.solvers.implicit.energies.potential import HessianBlocks, Potential, Projection

_CORNER_GRADIENTS = reference_gradients(np.eye(4))
_FIRST, _SECOND = np.triu_indices(10)


@dataclass(frozen=True, eq=False)
class BernsteinBarrier(Potential):
    """The barrier of some elements.

    Attributes
    ----------
    nodes : (k, 10); rest : (k, 20) C, all positive [m^3]; stiffness : (k,) kappa V / 20 [J]; onset : J0 [-]
    """

    nodes: NDArray[np.int32]
    rest: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    onset: float
    label = "elasticity"
    projection = Projection.RELEASED_FIRST

    def value(self, x: NDArray[np.float64]) -> float:
        energies = np.empty(len(self.nodes))
        _energies(determinant_coefficients(x, self.nodes) / self.rest, self.stiffness, self.onset, energies)
        return float(energies.sum())

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        self._add(x, out, None, False)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        """With `project`, without the term of the second derivative of the coefficients."""
        self._add(x, np.zeros_like(x), out, project)

    def add_model(
        self, x: NDArray[np.float64], gradient: NDArray[np.float64], hessian: HessianBlocks | None, project: bool
    ) -> float:
        """See `Potential.add_model`; most often no coefficient is below the onset, and the energy alone shows that."""
        energy = self.value(x)
        if energy:
            self._add(x, gradient, hessian, project)
        return energy

    def _add(
        self, x: NDArray[np.float64], gradient: NDArray[np.float64], hessian: HessianBlocks | None, project: bool
    ) -> None:
        ratios = determinant_coefficients(x, self.nodes) / self.rest
        active = np.flatnonzero((ratios < self.onset).any(axis=1))
        nodes, m = np.ascontiguousarray(self.nodes[active]), len(active)
        forces, blocks = np.zeros((m, 10, 3)), np.zeros((m if hessian is not None else 0, 10, 10, 3, 3))
        of_active = ratios[active], self.rest[active], self.stiffness[active], self.onset
        _derivatives(x, nodes, *of_active, _CORNER_GRADIENTS, hessian is not None, not project, forces, blocks)
        np.add.at(gradient, nodes, forces)
        if hessian is not None and m:
            rows, columns = nodes[:, _FIRST].ravel(), nodes[:, _SECOND].ravel()
            hessian.patches.append(Couplings(rows, columns, blocks[:, _FIRST, _SECOND].reshape(-1, 3, 3)))


@njit(cache=True)
def _energies(ratios, stiffness, onset, out):
    for e in range(len(ratios)):
        out[e] = 0.0
        for k in range(TERMS):
            out[e] += stiffness[e] * barrier_derivatives(ratios[e, k], onset)[0]


@njit
def _cross(u, v, out):
    out[0] = u[1] * v[2] - u[2] * v[1]
    out[1] = u[2] * v[0] - u[0] * v[2]
    out[2] = u[0] * v[1] - u[1] * v[0]


@njit(cache=True)
def _derivatives(x, nodes, ratios, rest, stiffness, onset, g, second, curved, forces, blocks):
    """Gradients (m, 10, 3) and, if `second`, the blocks (m, 10, 10, 3, 3) of nodes n <= m; without the second
    derivatives of coefficients unless `curved`."""
    D, slopes = np.empty((4, 3, 3)), np.empty((TERMS, 10, 3))
    vw, wu, uv = np.empty(3), np.empty(3), np.empty(3)
    first, bend = np.empty(TERMS), np.empty(TERMS)
    for e in range(len(nodes)):
        corner_derivatives(x, nodes, e, D)
        for k in range(TERMS):
            _, one, two = barrier_derivatives(ratios[e, k], onset)
            first[k], bend[k] = stiffness[e] * one / rest[e, k], stiffness[e] * two / (rest[e, k] * rest[e, k])
        slopes[:] = 0.0
        for a in range(4):
            for b in range(4):
                for c in range(4):
                    k = TERM[a, b, c]
                    if bend[k] == 0.0:
                        continue
                    u, v, w = D[a, 0], D[b, 1], D[c, 2]
                    _cross(v, w, vw)
                    _cross(w, u, wu)
                    _cross(u, v, uv)
                    for n in range(10):
                        for i in range(3):
                            part = g[a, n, 0] * vw[i] + g[b, n, 1] * wu[i] + g[c, n, 2] * uv[i]
                            slopes[k, n, i] += part / COUNT[k]
                    if second and curved:
                        f = first[k] / COUNT[k]
                        for n in range(10):
                            for m in range(n, 10):
                                p = f * (g[a, n, 0] * g[b, m, 1] - g[b, n, 1] * g[a, m, 0])
                                q = f * (g[b, n, 1] * g[c, m, 2] - g[c, n, 2] * g[b, m, 1])
                                r = f * (g[c, n, 2] * g[a, m, 0] - g[a, n, 0] * g[c, m, 2])
                                t0 = p * w[0] + q * u[0] + r * v[0]
                                t1 = p * w[1] + q * u[1] + r * v[1]
                                t2 = p * w[2] + q * u[2] + r * v[2]
                                blocks[e, n, m, 0, 1] += t2
                                blocks[e, n, m, 0, 2] -= t1
                                blocks[e, n, m, 1, 0] -= t2
                                blocks[e, n, m, 1, 2] += t0
                                blocks[e, n, m, 2, 0] += t1
                                blocks[e, n, m, 2, 1] -= t0
        for k in range(TERMS):
            if bend[k] == 0.0:
                continue
            for n in range(10):
                for i in range(3):
                    forces[e, n, i] += first[k] * slopes[k, n, i]
                if second:
                    for m in range(n, 10):
                        for i in range(3):
                            for j in range(3):
                                blocks[e, n, m, i, j] += bend[k] * slopes[k, n, i] * slopes[k, m, j]


@njit
def barrier_derivatives(J, onset):
    """b and its first and second derivative by J."""
    y = J / onset
    if not y < 1.0:
        return 0.0, 0.0, 0.0
    if y <= 0.0:
        return math.inf, 0.0, 0.0
    log, ratio = math.log(y), (y - 1.0) / y
    first = -2.0 * (y - 1.0) * log - (y - 1.0) * ratio
    return -(y - 1.0) * (y - 1.0) * log, first / onset, (-2.0 * log - 4.0 * ratio + ratio * ratio) / (onset * onset)
