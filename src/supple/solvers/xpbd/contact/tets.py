"""Volumes of tets within a substep: J of all of them, and how far motions may go so that J stays positive.

det is affine in the place of each vertex. So if it is positive at all sixteen corners, where each vertex has made none
of its motion or the share t, it is positive wherever the vertices have independently made any part of that share.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.model.system import System
from supple.numerics.adjacency import Adjacency, adjacency
from supple.numerics.mat3 import cross, dot, row, subtract
from supple.runtime.kernel_cache import njit

# Below this J a tet may lose nothing more in a substep: shares of it would fall below round-off within some substeps.
FLATTEST = 0.01
# The J down to which tets may come by what projections leave over, as by the barrier of `Implicit`. A share alone of
# what is asked for, substep after substep, took tets from 0.25 to 0.001 where loads asked for 0.8.
HELD = 0.1
# The guard projects a tet below this J that loses any volume, and above it one that loses more than half of it.
ONSET = 0.25


class Tets(NamedTuple):
    """The tets of a system.

    Attributes
    ----------
    nodes : (m, 4); scales : (m,) J over the determinant
    around : the tets of each node
    J : (m,) at the beginning of the substep; now : (m,) as measured last
    low : (4 m,) numbers of tets, scratch memory
    """

    nodes: NDArray[np.uint32]
    scales: NDArray[np.float64]
    around: Adjacency
    J: NDArray[np.float64]
    now: NDArray[np.float64]
    low: NDArray[np.int64]

    @classmethod
    def of(cls, system: System, count: int) -> Tets:
        """Of a system, among `count` nodes."""
        m = len(system.tets)
        around = adjacency(system.tets.ravel(), np.repeat(np.arange(m), 4), count)
        nodes = np.ascontiguousarray(system.tets, dtype=np.uint32)
        scales = 1.0 / (6.0 * system.rest_volumes)
        return cls(nodes, scales, around, np.zeros(m), np.zeros(m), np.zeros(4 * m, dtype=np.int64))


@njit
def determinant(x, nodes, t):
    a = row(x, nodes[t, 0])
    u, v, w = subtract(row(x, nodes[t, 1]), a), subtract(row(x, nodes[t, 2]), a), subtract(row(x, nodes[t, 3]), a)
    return dot(u, cross(v, w))


@njit(inline="always")
def least_J(before, share):
    """What must remain of J: a share of it, or all of it below `FLATTEST`. Inverted tets are not guarded."""
    return min((1.0 - 1e-6) * before, max(share * before, FLATTEST)) if before > 0.0 else -np.inf


@njit(inline="always")
def guarded_J(before):
    """The smallest J that the guard allows."""
    return min(before, max(ONSET, 0.5 * before)) if before > 0.0 else -np.inf


@njit(cache=True)
def measure(points, tets, guard, share):
    """Write J of all tets; returns how many, listed in `low`, have less than what must remain.

    That is this share of what the guard asks for, or, without `guard`, of J at the beginning.
    """
    count = 0
    for t in range(len(tets.nodes)):
        J = tets.scales[t] * determinant(points, tets.nodes, t)
        tets.now[t] = J
        asked = guarded_J(tets.J[t])
        # A tet that is nearly flat must not be left to `admit`, which would stop it.
        bound = max(share * asked, min(asked, HELD)) if guard else least_J(tets.J[t], share)
        if not bound <= J:
            tets.low[count] = t
            count += 1
    return count


@njit(cache=True)
def project_low(points, tets, islands, bounds):
    """Project the tets of active islands with less volume than the guard asks for; bounds : (m,) scratch memory."""
    for t in range(len(bounds)):
        active = islands.active[islands.root[islands.piece[tets.nodes[t, 0]]]]
        bounds[t] = guarded_J(tets.J[t]) if active else -np.inf
    _project(points, tets.nodes, tets.scales, bounds)


@njit(inline="always")
def _edges(points, a, b, d, e):
    ax, ay, az = points[a, 0], points[a, 1], points[a, 2]
    return (
        points[b, 0] - ax, points[b, 1] - ay, points[b, 2] - az,
        points[d, 0] - ax, points[d, 1] - ay, points[d, 2] - az,
        points[e, 0] - ax, points[e, 1] - ay, points[e, 2] - az,
    )  # fmt: skip


@njit
def _project(points, tets, scale, bounds):
    """Project every tet below its bound, once forward and once backward over all tets, in place.

    The correction only ends a compression. In the metric of the masses it is a projection of the displacement of the
    substep onto a half-space that contains zero, so that it takes kinetic energy and never gives any.
    """
    m = len(tets)
    for turn in range(2):
        for k in range(m):
            t = k if turn == 0 else m - 1 - k
            if bounds[t] == -np.inf:
                continue
            a, b, d, e = tets[t, 0], tets[t, 1], tets[t, 2], tets[t, 3]
            ux, uy, uz, vx, vy, vz, qx, qy, qz = _edges(points, a, b, d, e)
            gbx, gby, gbz = vy * qz - vz * qy, vz * qx - vx * qz, vx * qy - vy * qx
            det = gbx * ux + gby * uy + gbz * uz
            lack = bounds[t] / scale[t] - det
            if not lack > 0.0:
                continue
            gdx, gdy, gdz = qy * uz - qz * uy, qz * ux - qx * uz, qx * uy - qy * ux
            gex, gey, gez = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            gax, gay, gaz = -gbx - gdx - gex, -gby - gdy - gey, -gbz - gdz - gez
            wa, wb, wd, we = points[a, 3], points[b, 3], points[d, 3], points[e, 3]
            slope = (
                wa * (gax * gax + gay * gay + gaz * gaz)
                + wb * (gbx * gbx + gby * gby + gbz * gbz)
                + wd * (gdx * gdx + gdy * gdy + gdz * gdz)
                + we * (gex * gex + gey * gey + gez * gez)
            )
            # Where all four are in a line, or held, no direction changes the volume.
            if not slope > 0.0:
                continue
            dlam = lack / slope
            sa, sb, sd, se = wa * dlam, wb * dlam, wd * dlam, we * dlam
            points[a, 0] += sa * gax
            points[a, 1] += sa * gay
            points[a, 2] += sa * gaz
            points[b, 0] += sb * gbx
            points[b, 1] += sb * gby
            points[b, 2] += sb * gbz
            points[d, 0] += sd * gdx
            points[d, 1] += sd * gdy
            points[d, 2] += sd * gdz
            points[e, 0] += se * gex
            points[e, 1] += se * gey
            points[e, 2] += se * gez


@njit
def _least_corner(base, points, tets, t, share):
    """The smallest determinant where each vertex has made none of its motion, or this share of it."""
    least = np.inf
    for bits in range(1, 16):
        corner = (
            _part(base, points, tets.nodes[t, 0], share if bits & 1 else 0.0),
            _part(base, points, tets.nodes[t, 1], share if bits & 2 else 0.0),
            _part(base, points, tets.nodes[t, 2], share if bits & 4 else 0.0),
            _part(base, points, tets.nodes[t, 3], share if bits & 8 else 0.0),
        )
        u, v, w = subtract(corner[1], corner[0]), subtract(corner[2], corner[0]), subtract(corner[3], corner[0])
        least = min(least, dot(u, cross(v, w)))
    return least


@njit(inline="always")
def _part(base, points, i, share):
    return (
        base[i, 0] + share * (points[i, 0] - base[i, 0]),
        base[i, 1] + share * (points[i, 1] - base[i, 1]),
        base[i, 2] + share * (points[i, 2] - base[i, 2]),
    )


@njit
def share_of_tet(base, points, tets, t, keep):
    """The largest share of the motions from `base` that a tet can make, to 1/256; 1 where it can make all."""
    # A little more than the required volume, so that round-off does not require a second cut.
    J = tets.J[t]
    bound = min((1.0 - 5e-7) * J, (1.0 + 1e-9) * max(keep * J, FLATTEST)) / tets.scales[t]
    if _least_corner(base, points, tets, t, 1.0) >= bound:
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(8):
        middle = 0.5 * (low + high)
        if _least_corner(base, points, tets, t, middle) >= bound:
            low = middle
        else:
            high = middle
    return low
