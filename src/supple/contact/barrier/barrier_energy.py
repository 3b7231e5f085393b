"""The energy of a barrier over contacts, with its derivatives by the points of the surfaces.

    E = kappa sum_k a_k e(d_k)

with the gaps d_k (distances less offsets), the areas a_k, which are not differentiated, and the barrier of one gap, an
energy per area and pressure that grows without bound as the gap goes to zero:

    e(d) = dhat b(d^2 / dhat^2),  b(s) = -(s - 1)^2 ln s  for s < 1, else 0

Below `soft` [m], where that is above zero, e goes on as its quadratic expansion there, so that one linearization leads
out of any distance. Then the filter of steps alone keeps surfaces apart.

Source: Li et al., "Incremental Potential Contact" (2020), equation 6; Li et al., "Convergent Incremental Potential
Contact" (2023), for the unit.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from supple.contact.barrier.on_points import add_forces, room_for_blocks
from supple.contact.barrier.pair_hessian import write_pair_hessian
from supple.contact.features.contacts import Contacts
from supple.contact.features.pair_geometry import EDGE_EDGE, point_count
from supple.numerics.mat3 import row
from supple.numerics.sparse.couplings import Couplings
from supple.runtime.kernel_cache import njit, prange


@njit
def _value(d, dhat):
    r = d / dhat
    # s - 1 = (r - 1)(r + 1) has no cancellation near dhat.
    below = (r - 1.0) * (r + 1.0)
    return -dhat * below * below * 2.0 * math.log(r)


@njit
def _slopes(d, dhat):
    r = d / dhat
    s = r * r
    below = (r - 1.0) * (r + 1.0)
    log = 2.0 * math.log(r)
    first = -below * (2.0 * log + below / s)
    second = -2.0 * log - 4.0 * below / s + below * below / (s * s)
    return 2.0 * r * first, (4.0 * s * second + 2.0 * first) / dhat


@njit
def barrier_value(d, dhat, soft=0.0):
    """e(d) [m] for d > 0."""
    if d >= dhat:
        return 0.0
    if d >= soft:
        return _value(d, dhat)
    first, second = _slopes(soft, dhat)
    return _value(soft, dhat) + (d - soft) * (first + 0.5 * (d - soft) * second)


@njit
def barrier_slopes(d, dhat, soft=0.0):
    """First and second derivative of e by d [1, 1/m] for d > 0: not above and not below zero."""
    if d >= dhat:
        return 0.0, 0.0
    if d >= soft:
        return _slopes(d, dhat)
    first, second = _slopes(soft, dhat)
    return first + (d - soft) * second, second


@njit(cache=True)
def barrier_energy(contacts, dhat, stiffness, soft=0.0):
    """E [J], infinite where a point is on a plane or behind it; stiffness : kappa [Pa]."""
    _, _, _, _, _, weights, gaps = contacts
    total = 0.0
    for k in range(len(gaps)):
        if gaps[k] <= 0.0:
            return np.inf
        total += weights[k] * barrier_value(gaps[k], dhat, soft)
    return stiffness * total


@njit(cache=True)
def barrier_forces(contacts, dhat, stiffness, soft=0.0):
    """(k,) normal forces -dE/dd [N], zero or more."""
    _, _, _, _, _, weights, gaps = contacts
    out = np.empty(len(gaps))
    for k in range(len(gaps)):
        out[k] = -stiffness * weights[k] * barrier_slopes(gaps[k], dhat, soft)[0]
    return out


@njit(cache=True)
def predicted_forces(distances, changes, weights, dhat, soft):
    """(k,) forces, zero or more, after changes (k,) [m] of the distances, as the linearization of those says.

    weights : (k,) kappa a_k [N]
    """
    out = np.empty(len(distances))
    for k in range(len(out)):
        first, second = barrier_slopes(distances[k], dhat, soft)
        out[k] = max(0.0, -weights[k] * (first + changes[k] * second))
    return out


def add_barrier_gradient(
    contacts: Contacts, dhat: float, stiffness: float, out: NDArray[np.float64], soft: float = 0.0
) -> None:
    """Add the gradient by the points [N] to `out` (s, 3)."""
    sizes = -barrier_forces(contacts, dhat, stiffness, soft) / contacts.distances
    add_forces(*contacts[:3], sizes, contacts.vectors, out)


def barrier_hessian(
    x: NDArray[np.float64], contacts: Contacts, dhat: float, stiffness: float, project: bool, soft: float = 0.0
) -> Couplings:
    """The Hessian by the points x (s, 3) [N/m]; with `project`, larger and positive semi-definite."""
    between, start = room_for_blocks(contacts.kinds, contacts.points)
    _write_hessians(x, contacts, start, dhat, stiffness, soft, project, between.blocks)
    return between


@njit(cache=True, parallel=True)
def _write_hessians(x, contacts, start, dhat, stiffness, soft, project, out):
    kinds, _, _, _, _, weights, _ = contacts
    for k in prange(len(kinds)):
        follows = k > 0 and kinds[k - 1] == EDGE_EDGE and weights[k] < 0.0
        followed = k + 1 < len(kinds) and kinds[k] == EDGE_EDGE and weights[k + 1] < 0.0
        if project and follows:
            out[start[k] : start[k + 1]] = 0.0  # part of the matrix of the one before
        elif project and followed:
            _write_joint_hessian(x, contacts, k, dhat, stiffness, soft, out[start[k] : start[k + 1]])
        else:
            _write_hessian(x, contacts, k, dhat, stiffness, soft, project, out, start[k])


@njit
def _write_hessian(x, contacts, k, dhat, stiffness, soft, project, out, first):
    """The blocks (i, j), i <= j, of contact k."""
    kinds, points, coefficients, vectors, distances, weights, gaps = contacts
    c = (coefficients[k, 0], coefficients[k, 1], coefficients[k, 2], coefficients[k, 3])
    # Points that the kind does not have are ignored; any row may stand for them.
    stencil = (row(x, points[k, 0]), row(x, points[k, 1]), row(x, points[k, 2]), row(x, points[k, 3]))
    slope, curvature = barrier_slopes(gaps[k], dhat, soft)
    size = stiffness * weights[k]
    slopes = (size * slope, size * curvature)
    write_pair_hessian(kinds[k], c, row(vectors, k), distances[k], stencil, slopes, project, out, first)


@njit
def _write_joint_hessian(x, contacts, k, dhat, stiffness, soft, out):
    """The positive part of the sum of two edges and of their nearest end, contact k + 1, whose energy is taken away.

    Most of both cancels where the closest points are near that end. The positive parts of each would remain, and be
    many times too stiff.
    """
    kinds, points, _, _, _, _, _ = contacts
    blocks = np.empty((10, 3, 3))
    dense = np.zeros((12, 12))
    for m in range(k, k + 2):
        _write_hessian(x, contacts, m, dhat, stiffness, soft, False, blocks, 0)
        b = 0
        for i in range(point_count(kinds[m])):
            p = _place(points, k, points[m, i])
            for j in range(i, point_count(kinds[m])):
                q = _place(points, k, points[m, j])
                for u in range(3):
                    for v in range(3):
                        dense[3 * p + u, 3 * q + v] += blocks[b, u, v]
                        if p != q:
                            dense[3 * q + v, 3 * p + u] += blocks[b, u, v]
                b += 1
    values, modes = np.linalg.eigh(dense)
    b = 0
    for i in range(4):
        for j in range(i, 4):
            for u in range(3):
                for v in range(3):
                    total = 0.0
                    for m in range(12):
                        if values[m] > 0.0:
                            total += modes[3 * i + u, m] * values[m] * modes[3 * j + v, m]
                    out[b, u, v] = total
            b += 1


@njit
def _place(points, k, point):
    """Which of the points of contact k a point is."""
    for i in range(4):
        if points[k, i] == point:
            return i
    return -1
