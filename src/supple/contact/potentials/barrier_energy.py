"""The energy of a barrier over contacts, with its derivatives by the points of the surfaces.

    E = kappa sum_k a_k e(d_k)

with the areas a_k, and e as in `barrier_function`. Areas are not differentiated.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.contact.closest.pair_geometry import point_count
from supple.contact.potentials.barrier_function import barrier_slopes, barrier_value
from supple.contact.potentials.contacts import Contacts
from supple.contact.potentials.pair_hessian import write_pair_hessian
from supple.numerics.kernel_cache import njit, prange
from supple.numerics.mat3 import row
from supple.numerics.sparse.couplings import Couplings
from supple.numerics.threads import threads_for

# Contacts from which a second thread pays.
_PARALLEL_FROM = 300


@njit(cache=True, error_model="numpy")
def barrier_energy(contacts, dhat, stiffness):
    """E [J]; stiffness : kappa [Pa]."""
    _, _, _, _, distances, weights = contacts
    total = 0.0
    for k in range(len(distances)):
        total += weights[k] * barrier_value(distances[k], dhat)
    return stiffness * total


@njit(cache=True, error_model="numpy")
def barrier_forces(contacts, dhat, stiffness):
    """(k,) normal forces -dE/dd [N], zero or more."""
    _, _, _, _, distances, weights = contacts
    out = np.empty(len(distances))
    for k in range(len(distances)):
        out[k] = -stiffness * weights[k] * barrier_slopes(distances[k], dhat)[0]
    return out


@njit(cache=True, error_model="numpy")
def add_barrier_gradient(contacts, dhat, stiffness, out):
    """Add the gradient by the points [N] to `out` (s, 3)."""
    kinds, points, coefficients, vectors, distances, weights = contacts
    for k in range(len(distances)):
        size = stiffness * weights[k] * barrier_slopes(distances[k], dhat)[0] / distances[k]
        for i in range(point_count(kinds[k])):
            for j in range(3):
                out[points[k, i], j] += size * coefficients[k, i] * vectors[k, j]


def barrier_hessian(
    x: NDArray[np.float64], contacts: Contacts, dhat: float, stiffness: float, project: bool
) -> Couplings:
    """The Hessian by the points x (s, 3) [N/m]; with `project`, larger and positive semi-definite."""
    start = block_starts(contacts.kinds)
    rows, columns = block_points(contacts.kinds, contacts.points, start)
    blocks = np.empty((start[-1], 3, 3))
    with threads_for(len(contacts.kinds), _PARALLEL_FROM):
        _write_hessians(x, contacts, start, dhat, stiffness, project, blocks)
    return Couplings(rows, columns, blocks)


@njit(cache=True, error_model="numpy")
def block_starts(kinds):
    """(k + 1,) where the blocks of each contact begin: one for each unordered pair of its points."""
    start = np.zeros(len(kinds) + 1, dtype=np.int64)
    for k in range(len(kinds)):
        count = point_count(kinds[k])
        start[k + 1] = start[k] + count * (count + 1) // 2
    return start


@njit(cache=True, error_model="numpy")
def block_points(kinds, points, start):
    """Rows and columns (t,) of the blocks (i, j), i <= j, of contacts."""
    rows = np.empty(start[-1], dtype=np.int32)
    columns = np.empty(start[-1], dtype=np.int32)
    b = 0
    for k in range(len(kinds)):
        count = point_count(kinds[k])
        for i in range(count):
            for j in range(i, count):
                rows[b], columns[b] = points[k, i], points[k, j]
                b += 1
    return rows, columns


@njit(cache=True, parallel=True, error_model="numpy")
def _write_hessians(x, contacts, start, dhat, stiffness, project, out):
    kinds, points, coefficients, vectors, distances, weights = contacts
    for k in prange(len(kinds)):
        c = (coefficients[k, 0], coefficients[k, 1], coefficients[k, 2], coefficients[k, 3])
        # Points that the kind does not have are ignored; any row may stand for them.
        stencil = (row(x, points[k, 0]), row(x, points[k, 1]), row(x, points[k, 2]), row(x, points[k, 3]))
        first, second = barrier_slopes(distances[k], dhat)
        size = stiffness * weights[k]
        slopes = (size * first, size * second)
        write_pair_hessian(kinds[k], c, row(vectors, k), distances[k], stencil, slopes, project, out, start[k])
