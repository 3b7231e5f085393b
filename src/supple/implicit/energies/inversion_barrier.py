"""A barrier against inversion, for materials that have none: it acts only on tets that have lost most of their volume.

Stable Neo-Hookean and the corotated materials have a finite energy at J = 0: pressed hard enough, the minimum of their
energy lies beyond inversion, and a step filter alone would stop Newton's method in front of it without a minimum to
converge to. With y = J / J0 and the onset J0,

    B = V kappa b(y),    b(y) = -(y - 1)^2 ln y for y < 1, else 0,    kappa = J0 (mu + lam),

the minimum exists again. b has two continuous derivatives. A tet with J >= J0 does not feel it.

Source of b: Li et al., "Incremental Potential Contact" (2020), equation 6, with the volume in place of the distance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from supple.implicit.energies.elasticity import SERIAL_TETS, Elasticity, gather_gradients
from supple.implicit.energies.potential import HessianBlocks, Potential, Projection
from supple.materials.registry import needs_positive_volume
from supple.numerics.threads import threads_for


@dataclass(frozen=True, eq=False)
class InversionBarrier(Potential):
    """The barrier of the tets that have a stiffness here.

    Attributes
    ----------
    stiffness : (m,) kappa V [J], zero for tets without a barrier
    onset : J0 [-]
    """

    elasticity: Elasticity
    stiffness: NDArray[np.float64]
    onset: float
    label = "elasticity"
    projection = Projection.RELEASED_FIRST

    def value(self, x: NDArray[np.float64]) -> float:
        s = self.elasticity.system
        out = np.empty(len(s.tets))
        with threads_for(len(s.tets), SERIAL_TETS):
            _energies(x, s.tets, s.rest_volumes, self.stiffness, self.onset, out)
        return float(out.sum())

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        s = self.elasticity.system
        if not self.value(x):
            return
        gradients = np.empty((len(s.tets), 4, 3))
        with threads_for(len(s.tets), SERIAL_TETS):
            _gradients(x, s.tets, s.rest_volumes, self.stiffness, self.onset, gradients)
            gather_gradients(self.elasticity.start, self.elasticity.incidence, gradients, out)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        """With `project`, without the term of the second derivative of J, whose factor is negative."""
        s = self.elasticity.system
        with threads_for(len(s.tets), SERIAL_TETS):
            _hessians(x, s.tets, s.rest_volumes, self.stiffness, self.onset, project, out.tets)


def inversion_barrier(elasticity: Elasticity, guarded: NDArray[np.bool_], onset: float) -> InversionBarrier | None:
    """The barrier below J = `onset` of the guarded tets whose material has none; None where there is no such tet."""
    material = elasticity.material
    wanted = guarded & ~needs_positive_volume(material.kind)
    if not wanted.any():
        return None
    kappa = onset * (material.mu + np.abs(material.lam))
    return InversionBarrier(elasticity, np.where(wanted, kappa * elasticity.system.rest_volumes, 0.0), onset)


@njit(cache=True, error_model="numpy")
def _edge(x, tets, e, k):
    a, b = tets[e, 0], tets[e, k]
    return (x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2])


@njit(cache=True, error_model="numpy")
def _areas(x, tets, e):
    """Edges u, v, w from node 0, and v x w, w x u, u x v: the derivatives of u . (v x w) = 6 V J by nodes 1, 2, 3."""
    u, v, w = _edge(x, tets, e, 1), _edge(x, tets, e, 2), _edge(x, tets, e, 3)
    vw = (v[1] * w[2] - v[2] * w[1], v[2] * w[0] - v[0] * w[2], v[0] * w[1] - v[1] * w[0])
    wu = (w[1] * u[2] - w[2] * u[1], w[2] * u[0] - w[0] * u[2], w[0] * u[1] - w[1] * u[0])
    uv = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
    return u, v, w, vw, wu, uv


@njit(cache=True, parallel=True, error_model="numpy")
def _energies(x, tets, volumes, stiffness, onset, out):
    for e in prange(len(tets)):
        out[e] = 0.0
        if stiffness[e] > 0.0:
            u, _, _, vw, _, _ = _areas(x, tets, e)
            y = (u[0] * vw[0] + u[1] * vw[1] + u[2] * vw[2]) / (6.0 * volumes[e] * onset)
            if y < 1.0:
                out[e] = -stiffness[e] * (y - 1.0) * (y - 1.0) * math.log(y) if y > 0.0 else math.inf


@njit(cache=True, parallel=True, error_model="numpy")
def _gradients(x, tets, volumes, stiffness, onset, out):
    for e in prange(len(tets)):
        u, _, _, vw, wu, uv = _areas(x, tets, e)
        dy = 1.0 / (6.0 * volumes[e] * onset)
        y = dy * (u[0] * vw[0] + u[1] * vw[1] + u[2] * vw[2])
        f = 0.0
        if stiffness[e] > 0.0 and 0.0 < y < 1.0:
            f = dy * stiffness[e] * (-2.0 * (y - 1.0) * math.log(y) - (y - 1.0) * (y - 1.0) / y)
        for i in range(3):
            out[e, 1, i], out[e, 2, i], out[e, 3, i] = f * vw[i], f * wu[i], f * uv[i]
            out[e, 0, i] = -(out[e, 1, i] + out[e, 2, i] + out[e, 3, i])


@njit(cache=True, parallel=True, error_model="numpy")
def _hessians(x, tets, volumes, stiffness, onset, project, out):
    for e in prange(len(tets)):
        if stiffness[e] == 0.0:
            continue
        u, v, w, vw, wu, uv = _areas(x, tets, e)
        dy = 1.0 / (6.0 * volumes[e] * onset)
        y = dy * (u[0] * vw[0] + u[1] * vw[1] + u[2] * vw[2])
        if not 0.0 < y < 1.0:
            continue
        first = dy * stiffness[e] * (-2.0 * (y - 1.0) * math.log(y) - (y - 1.0) * (y - 1.0) / y)
        ratio = (y - 1.0) / y
        second = dy * dy * stiffness[e] * (-2.0 * math.log(y) - 4.0 * ratio + ratio * ratio)
        area = np.empty((4, 3))
        for i in range(3):
            area[1, i], area[2, i], area[3, i] = vw[i], wu[i], uv[i]
            area[0, i] = -(vw[i] + wu[i] + uv[i])
        for p in range(4):
            for q in range(4):
                for i in range(3):
                    for j in range(3):
                        out[e, 3 * p + i, 3 * q + j] += second * area[p, i] * area[q, j]
        if project:
            continue
        # d^2 J: nodes 1 and 2 are coupled by the cross product with w, and so on; node 0 takes the negative sums.
        K = np.zeros((4, 4, 3, 3))
        for p in range(3):
            a = w if p == 0 else (u if p == 1 else v)
            q, r = p + 1, (p + 1) % 3 + 1
            _put_cross(K, q, r, a, -first)
            _put_cross(K, r, q, a, first)
        for i in range(3):
            for j in range(3):
                total = 0.0
                for p in range(1, 4):
                    row = column = 0.0
                    for q in range(1, 4):
                        row += K[p, q, i, j]
                        column += K[q, p, i, j]
                    K[p, 0, i, j] = -row
                    K[0, p, i, j] = -column
                    total += row
                K[0, 0, i, j] = total
        for p in range(4):
            for q in range(4):
                for i in range(3):
                    for j in range(3):
                        out[e, 3 * p + i, 3 * q + j] += K[p, q, i, j]


@njit(cache=True, error_model="numpy")
def _put_cross(K, p, q, a, scale):
    """K[p, q] <- scale times the matrix of b -> a x b."""
    K[p, q, 0, 1] = -scale * a[2]
    K[p, q, 0, 2] = scale * a[1]
    K[p, q, 1, 0] = scale * a[2]
    K[p, q, 1, 2] = -scale * a[0]
    K[p, q, 2, 0] = -scale * a[1]
    K[p, q, 2, 1] = scale * a[0]
