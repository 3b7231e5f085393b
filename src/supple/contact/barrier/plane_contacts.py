"""Kernels of contact with half-spaces: one contact for each point near a plane.

A plane is two points, c and the tip c + L n of its normal. The distance of a point x is d = (x - c) . n; its
derivatives by c and the tip couple what touches the plane to a plane that moves.
"""

from __future__ import annotations

import math

import numpy as np

from supple.contact.barrier.barrier_energy import barrier_slopes, barrier_value
from supple.numerics.mat3 import dot, row, subtract
from supple.runtime.kernel_cache import njit


@njit
def height(x, pairs, k):
    """Signed distance of pair k [m], the plane's normal, and the length of its axis [m]."""
    base = row(x, pairs[k, 1])
    axis = subtract(row(x, pairs[k, 2]), base)
    length = math.sqrt(dot(axis, axis))
    n = (axis[0] / length, axis[1] / length, axis[2] / length)
    return dot(subtract(row(x, pairs[k, 0]), base), n), n, length


@njit(cache=True)
def near_planes(x, pairs, dhat):
    """The pairs (k, 3) of a point, base and tip that are nearer than dhat.

    Returns
    -------
    rows : (m,) rows of `pairs`; heights : (m,) [m]; normals : (m, 3)
    least : the smallest of all heights, infinite where there is no pair [m]
    """
    rows = np.empty(len(pairs), dtype=np.int32)
    heights, normals = np.empty(len(pairs)), np.empty((len(pairs), 3))
    least = np.inf
    m = 0
    for k in range(len(pairs)):
        d, n, _ = height(x, pairs, k)
        least = min(least, d)
        if d < dhat:
            rows[m], heights[m] = k, d
            normals[m, 0], normals[m, 1], normals[m, 2] = n
            m += 1
    return rows[:m].copy(), heights[:m].copy(), normals[:m].copy(), least


@njit(cache=True)
def plane_energy(near, areas, dhat, stiffness):
    """Energy [J] of the pairs of `near_planes`; infinite where a point is on the plane or behind it."""
    rows, heights, _, _ = near
    total = 0.0
    for m in range(len(rows)):
        if heights[m] <= 0.0:
            return np.inf
        total += areas[rows[m]] * barrier_value(heights[m], dhat)
    return stiffness * total


@njit(cache=True)
def plane_forces(near, areas, dhat, stiffness):
    """(m,) forces of the planes along their normals [N]; none on points behind them."""
    rows, heights, _, _ = near
    out = np.zeros(len(rows))
    for m in range(len(rows)):
        if heights[m] > 0.0:
            out[m] = -stiffness * areas[rows[m]] * barrier_slopes(heights[m], dhat)[0]
    return out


@njit(cache=True)
def add_plane_gradient(x, pairs, near, forces, out):
    """Add the gradient [N] to `out` (s, 3)."""
    rows = near[0]
    for m in range(len(rows)):
        k = rows[m]
        d, n, length = height(x, pairs, k)
        r = subtract(row(x, pairs[k, 0]), row(x, pairs[k, 1]))
        for j in range(3):
            # The tip turns the normal.
            along = (r[j] - d * n[j]) / length
            out[pairs[k, 0], j] -= forces[m] * n[j]
            out[pairs[k, 1], j] += forces[m] * (n[j] + along)
            out[pairs[k, 2], j] -= forces[m] * along


@njit(cache=True)
def plane_hessian(x, pairs, near, areas, dhat, stiffness):
    """Rows, columns and blocks of the Hessian: of points with themselves, with bases and with tips.

    Exact for the points; the coupling with the planes omits the rotation of the normal.
    """
    rows = near[0]
    one, two = np.empty(3 * len(rows), dtype=np.int32), np.empty(3 * len(rows), dtype=np.int32)
    blocks = np.empty((3 * len(rows), 3, 3))
    for m in range(len(rows)):
        k = rows[m]
        d, n, length = height(x, pairs, k)
        r = subtract(row(x, pairs[k, 0]), row(x, pairs[k, 1]))
        size = stiffness * areas[k] * barrier_slopes(d, dhat)[1] if d > 0.0 else 0.0
        for i in range(3):
            one[3 * m + i], two[3 * m + i] = pairs[k, 0], pairs[k, i]
        for p in range(3):
            for q in range(3):
                along = (r[q] - d * n[q]) / length
                blocks[3 * m, p, q] = size * n[p] * n[q]
                blocks[3 * m + 1, p, q] = -size * n[p] * (n[q] + along)
                blocks[3 * m + 2, p, q] = size * n[p] * along
    return one, two, blocks


@njit(cache=True)
def largest_plane_step(x, way, pairs, keep):
    """Largest step along `way` (s, 3), at most 1, after which every height is still the share `keep` of what it was.

    The height times the length of the normal is a quadratic in the step.

    Returns
    -------
    step : 0 where a point is not in front of its plane; pair : the row of `pairs` that limits it, or -1
    """
    step, pair = 1.0, -1
    for k in range(len(pairs)):
        base, change = row(x, pairs[k, 1]), row(way, pairs[k, 1])
        r, dr = subtract(row(x, pairs[k, 0]), base), subtract(row(way, pairs[k, 0]), change)
        m, dm = subtract(row(x, pairs[k, 2]), base), subtract(row(way, pairs[k, 2]), change)
        whole = dot(r, m)
        a, b, c = dot(dr, dm), dot(r, dm) + dot(dr, m), (1.0 - keep) * whole
        if not (whole > 0.0 and math.isfinite(a) and math.isfinite(b)):
            return 0.0, k
        root = _first_root(a, b, c)
        if root < step:
            step, pair = root, k
    return step, pair


@njit
def _first_root(a, b, c):
    """Smallest positive root of a t^2 + b t + c with c > 0, or infinity; without cancellation."""
    discriminant = b * b - 4.0 * a * c
    if discriminant < 0.0:
        return np.inf
    q = -0.5 * (b + math.copysign(math.sqrt(discriminant), b))
    first, second = q / a, c / q
    best = np.inf
    if first > 0.0:
        best = first
    if 0.0 < second < best:
        best = second
    return best
