"""Lagged, smoothed Coulomb friction of contacts.

    E = sum_k f_k F(|u_k|),  u = T sum_i c_i (x_i - o_i),  T = I - n n^T

with the largest forces f_k = mu lambda, the coefficients c and normals n of the contacts at an earlier state, and the
points o at the beginning of the step. F' rises smoothly from 0 to 1 at the displacement `reach`:

    F(y) = y^2 / e - y^3 / (3 e^2) + e / 3  for y < e, else y

Source: Li et al., "Incremental Potential Contact" (2020), section 5.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.contact.closest.pair_geometry import point_count
from supple.contact.potentials.barrier_energy import block_points, block_starts
from supple.numerics.kernel_cache import njit, prange
from supple.numerics.sparse.couplings import Couplings
from supple.numerics.threads import threads_for

# Contacts from which a second thread pays.
_PARALLEL_FROM = 300


class Slips(NamedTuple):
    """Arrays of k contacts with friction; kernels take it as it is.

    Attributes
    ----------
    kinds : (k,) int8; points : (k, 4) int32; coefficients : (k, 4), see `Contacts`
    normals : (k, 3) unit vectors
    offsets : (k, 3) sum_i c_i o_i, the relative position at which the contact has not slipped [m]
    forces : (k,) mu lambda [N]
    """

    kinds: NDArray[np.int8]
    points: NDArray[np.int32]
    coefficients: NDArray[np.float64]
    normals: NDArray[np.float64]
    offsets: NDArray[np.float64]
    forces: NDArray[np.float64]


@njit(error_model="numpy")
def friction_potential(y, e):
    """F(y) [m]"""
    return y if y >= e else y * y / e * (1.0 - y / (3.0 * e)) + e / 3.0


@njit(error_model="numpy")
def friction_ratio(y, e):
    """F'(y) / y [1/m]"""
    return 1.0 / y if y >= e else (2.0 - y / e) / e


@njit(error_model="numpy")
def friction_curvature(y, e):
    """F''(y) [1/m]"""
    return 0.0 if y >= e else 2.0 * (1.0 - y / e) / e


@njit(error_model="numpy")
def slip_of(x, slips, k):
    """u [m] of contact k."""
    kinds, points, coefficients, normals, offsets, _ = slips
    a = b = c = 0.0
    for i in range(point_count(kinds[k])):
        a += coefficients[k, i] * x[points[k, i], 0]
        b += coefficients[k, i] * x[points[k, i], 1]
        c += coefficients[k, i] * x[points[k, i], 2]
    a, b, c = a - offsets[k, 0], b - offsets[k, 1], c - offsets[k, 2]
    n = (normals[k, 0], normals[k, 1], normals[k, 2])
    along = a * n[0] + b * n[1] + c * n[2]
    return (a - along * n[0], b - along * n[1], c - along * n[2])


@njit(cache=True, error_model="numpy")
def friction_energy(x, slips, reach):
    """E at x (s, 3) [J]."""
    total = 0.0
    for k in range(len(slips[0])):
        u = slip_of(x, slips, k)
        total += slips[5][k] * friction_potential((u[0] * u[0] + u[1] * u[1] + u[2] * u[2]) ** 0.5, reach)
    return total


@njit(cache=True, error_model="numpy")
def add_friction_gradient(x, slips, reach, out):
    """Add the gradient [N] to `out` (s, 3)."""
    kinds, points, coefficients, _, _, forces = slips
    for k in range(len(kinds)):
        u = slip_of(x, slips, k)
        size = forces[k] * friction_ratio((u[0] * u[0] + u[1] * u[1] + u[2] * u[2]) ** 0.5, reach)
        for i in range(point_count(kinds[k])):
            for j in range(3):
                out[points[k, i], j] += size * coefficients[k, i] * u[j]


def friction_hessian(x: NDArray[np.float64], slips: Slips, reach: float, majorize: bool) -> Couplings:
    """The Hessian at x (s, 3), or with `majorize` that of the quadratic above E that touches it there [N/m].

    Both are positive semi-definite. The quadratic above has f F'(|u|) / |u| T for each contact: iteratively reweighted
    least squares.
    """
    start = block_starts(slips.kinds)
    rows, columns = block_points(slips.kinds, slips.points, start)
    blocks = np.empty((start[-1], 3, 3))
    with threads_for(len(slips.kinds), _PARALLEL_FROM):
        _write_hessians(x, slips, start, reach, majorize, blocks)
    return Couplings(rows, columns, blocks)


@njit(cache=True, parallel=True, error_model="numpy")
def _write_hessians(x, slips, start, reach, majorize, out):
    kinds, _, coefficients, normals, _, forces = slips
    for k in prange(len(kinds)):
        u = slip_of(x, slips, k)
        y = (u[0] * u[0] + u[1] * u[1] + u[2] * u[2]) ** 0.5
        across = friction_ratio(y, reach)
        # Along the slip the ratio changes to the curvature.
        more = 0.0 if majorize or y == 0.0 else (friction_curvature(y, reach) - across) / (y * y)
        count = point_count(kinds[k])
        b = start[k]
        for i in range(count):
            for j in range(i, count):
                size = forces[k] * coefficients[k, i] * coefficients[k, j]
                for p in range(3):
                    for q in range(3):
                        entry = more * u[p] * u[q] - across * normals[k, p] * normals[k, q]
                        out[b, p, q] = size * (entry + across if p == q else entry)
                b += 1
