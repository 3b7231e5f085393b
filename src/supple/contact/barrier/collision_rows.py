"""Collisions along a way, as linear rows: for pairs that would meet, the gap along the normal where they do.

With the closest points and the unit normal n at the time of a collision, the gap of a pair is n . sum_i c_i x_i less
its offsets, linear in the positions. A row keeps it at `target`, with the energy stiffness / 2 (gap - target)^2.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.contact.barrier.on_points import add_forces, product_blocks
from supple.contact.ccd import collision_time, is_clear
from supple.contact.features.pair_geometry import EDGE_EDGE, VERTEX_TRIANGLE, corners
from supple.numerics.geometry.closest_points import closest_on_segments, closest_on_triangle, combine
from supple.numerics.mat3 import dot
from supple.numerics.sparse.couplings import Couplings
from supple.runtime.kernel_cache import njit


class CollisionRows(NamedTuple):
    """k rows.

    Attributes
    ----------
    kinds, points, coefficients : (k,), (k, 4), (k, 4) as of `Contacts`
    normals : (k, 3) unit vectors from the second side to the first
    gaps : (k,) where the way begins [m]; ends : (k,) where it ends [m]
    """

    kinds: NDArray[np.int8]
    points: NDArray[np.int32]
    coefficients: NDArray[np.float64]
    normals: NDArray[np.float64]
    gaps: NDArray[np.float64]
    ends: NDArray[np.float64]

    @classmethod
    def room(cls, k: int) -> CollisionRows:
        """Rows to be written."""
        flat = np.zeros(k, dtype=np.int8), np.full((k, 4), -1, dtype=np.int32)
        return cls(*flat, np.zeros((k, 4)), np.zeros((k, 3)), np.zeros(k), np.zeros(k))

    def where(self, chosen: NDArray[np.bool_] | slice) -> CollisionRows:
        """The chosen ones (k,)."""
        return CollisionRows._make(array[chosen] for array in self)

    def joined(self, more: CollisionRows) -> CollisionRows:
        """These rows, then others."""
        return CollisionRows._make(np.concatenate(both) for both in zip(self, more, strict=True))

    def along(self, way: NDArray[np.float64]) -> CollisionRows:
        """The same rows, with the ends of another way (s, 3)."""
        moved = np.einsum("ki,kij,kj->k", self.coefficients, way[self.points], self.normals)
        return self._replace(ends=self.gaps + moved)


@njit
def _off(x, p, q):
    """x_q - x_p."""
    return (x[q, 0] - x[p, 0], x[q, 1] - x[p, 1], x[q, 2] - x[p, 2])


@njit
def _write(x, way, time, kind, points, offset, rows, k):
    """Write the row of a pair at `time` of its collision; all is relative to the first point, as round-off is."""
    p, q, r, s = points
    a, b, c = _off(x, p, q), _off(x, p, r), _off(x, p, s)
    u, v, w = _off(way, p, q), _off(way, p, r), _off(way, p, s)
    at = (_along(a, u, time), _along(b, v, time), _along(c, w, time))
    if kind == VERTEX_TRIANGLE:
        shares = closest_on_triangle((0.0, 0.0, 0.0), at[0], at[1], at[2])
        weights = (-shares[0], -shares[1], -shares[2])
    else:
        one, other = closest_on_segments((0.0, 0.0, 0.0), at[0], at[1], at[2])
        weights = (one, other - 1.0, -other)
    n = combine(weights, at[0], at[1], at[2])
    length = max(math.sqrt(dot(n, n)), 1e-300)
    n = (n[0] / length, n[1] / length, n[2] / length)
    rows.kinds[k] = kind
    rows.gaps[k] = dot(n, combine(weights, a, b, c)) - offset
    rows.ends[k] = rows.gaps[k] + dot(n, combine(weights, u, v, w))
    rows.coefficients[k, 0] = -(weights[0] + weights[1] + weights[2])
    for i in range(4):
        rows.points[k, i] = points[i]
        if i < 3:
            rows.coefficients[k, i + 1] = weights[i]
            rows.normals[k, i] = n[i]


@njit
def _along(a, u, time):
    return (a[0] + time * u[0], a[1] + time * u[1], a[2] + time * u[2])


@njit(cache=True)
def write_collisions(x, way, triangles, edges, offsets, point_pairs, edge_pairs, kept, rows):
    """Write the rows of all pairs that collide while points go from x (s, 3) along `way` (s, 3); returns their number.

    offsets : (s,), see `ContactMesh`; kept : see `Kept`. Where `rows` has no room, only the first ones are written.
    """
    count = 0
    for kind in (VERTEX_TRIANGLE, EDGE_EDGE):
        pairs = point_pairs if kind == VERTEX_TRIANGLE else edge_pairs
        for k in range(len(pairs)):
            points = corners(kind, triangles, edges, pairs[k, 0], pairs[k, 1])
            offset = offsets[points[0]] + offsets[points[2]]
            if is_clear(x, way, kind, points, offset):
                continue
            time = collision_time(x, way, kind, points, 1.0, kept, offset)
            if time <= 1.0:
                if count < len(rows.kinds):
                    _write(x, way, time, kind, points, offset, rows, count)
                count += 1
    return count


def add_row_gradient(rows: CollisionRows, stiffness: float, target: float, out: NDArray[np.float64]) -> None:
    """Add the gradient at the beginning of the way [N] to `out` (s, 3)."""
    add_forces(*rows[:3], stiffness * (rows.gaps - target), rows.normals, out)


def row_hessian(rows: CollisionRows, stiffness: float) -> Couplings:
    """The Hessian by the points [N/m]."""
    n = rows.normals
    return product_blocks(*rows[:3], np.full(len(n), stiffness), n[:, :, None] * n[:, None, :])
