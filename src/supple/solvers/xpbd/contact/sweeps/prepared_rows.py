"""Rows of contact with what remains the same in all passes of a substep, found once.

A row is one line of numbers, which kernels find by columns. Arguments of many arrays, which tell a kernel where each of
them lies, cost a sweep more than its arithmetic.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.numerics.mat3 import row
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.contact.impulses import compliance, shift_compliance
from supple.solvers.xpbd.contact.sweeps.rigid_rows import RIGID_COLUMNS, join_points, prepare_bodies
from supple.solvers.xpbd.contact.sweeps.vertex_rows import VERTEX_COLUMNS, prepare_vertices

# What a unit push changes the relative place by along the normal, and what a unit shift does [1/kg]; the columns of
# `rigid_rows` or `vertex_rows` follow.
TOTAL, YIELD, FIRST = 0, 1, 2
COLUMNS = FIRST + max(RIGID_COLUMNS, VERTEX_COLUMNS)
# In place of the first body: of a row that moves vertices alone, and of one that moves vertices and a rigid body.
VERTICES, BOTH = -2, -3


class PreparedRows(NamedTuple):
    """k rows, as kernels receive them.

    Attributes
    ----------
    bodies : (k, 2) the rigid bodies of each row, -1 for none; VERTICES or BOTH for the first where it moves vertices
    numbers : (k, COLUMNS)
    """

    bodies: NDArray[np.int64]
    numbers: NDArray[np.float64]


@njit(cache=True)
def prepare_rows(chosen, movers, rows):
    """Prepare the chosen rows; see `solve_rows`."""
    count, vertices, weights, normals = len(chosen), rows[0], rows[1], rows[2]
    out = PreparedRows(np.empty((count, 2), dtype=np.int64), np.zeros((count, COLUMNS)))
    bodies, numbers = out
    for k in range(count):
        e = chosen[k]
        numbers[k, TOTAL] = compliance(movers, vertices, weights, e, row(normals, e))
        numbers[k, YIELD] = shift_compliance(movers, vertices, weights, e)
        any_body, any_vertex = False, False
        for i in range(4):
            p = vertices[e, i]
            any_body = any_body or movers.body[p] >= 0
            any_vertex = any_vertex or movers.inverse_masses[p] > 0.0
        mine = numbers[k, FIRST:]
        if not any_body:
            bodies[k, 0] = VERTICES
            prepare_vertices(mine, movers.inverse_masses, vertices[e], weights[e])
        elif any_vertex or not join_points(bodies[k], mine, movers, vertices[e], weights[e]):
            bodies[k, 0] = BOTH
        else:
            prepare_bodies(bodies[k], mine, movers.w, movers.J)
    return out
