"""No tetrahedron turns inside out: a unilateral constraint on J, with no energy of its own.

The elastic energies of XPBD are finite at J = 0, so that a fast impact can push a tet through zero volume, where its
forces point the wrong way. At the end of a substep every guarded tet must have

    J >= min(J_n, max(ONSET, KEEP J_n))

with J_n at its beginning. Tets that do not are projected to this bound. It is never above J_n: the projection only ends
a compression. In the metric of the masses it is a projection of the displacement of the substep onto a half-space that
contains zero, so that it takes kinetic energy and never gives any: a perfectly inelastic collision inside of the body.

Bodies that have inverted tets when a frame begins are not guarded: to untangle, some of their tets must pass through
zero volume.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.model.system import System
from supple.runtime.kernel_cache import njit, prange

# Above ONSET a tet may lose half of its volume in one substep; below, it may not lose any more.
ONSET, KEEP = 0.25, 0.5
# Shares of the bound: where the projections may end, and below which the substep counts as failed. What is left over is
# projected in the next substep.
ENOUGH, LEAST_SHARE = 0.7, 0.1
# Below this J, nothing may be left over: otherwise J could fall by a share in every substep.
STRICT = 0.1
# Below this J, a tet that loses any volume counts as failed: it is too flat to bound its loss by a share.
FLATTEST = 1e-3
BLOCK = 1024


class VolumeGuard:
    """The guard on all tets of a system, in the solver's numbering of vertices.

    Attributes
    ----------
    guarded : (m,) the tets that may not turn over
    J : (m,) of each tet, as measured last
    bounds : (m,) what J must not fall below in this substep; minus infinity where a tet is not guarded
    """

    def __init__(self, system: System) -> None:
        self.tets = np.ascontiguousarray(system.tets, dtype=np.uint32)
        self.scale = 1.0 / (6.0 * system.rest_volumes)
        m = len(self.tets)
        self.J, self.bounds = np.zeros(m), np.full(m, -np.inf)
        self.guarded = np.zeros(m, dtype=np.bool_)

    def measure(self, points: NDArray[np.float64], share: float = 1.0) -> bool:
        """Compute J at `points` (n, 4); returns whether a tet is below this share of its bound."""
        return _measure(points, self.tets, self.scale, self.bounds, share, self.J) > 0

    def project(self, points: NDArray[np.float64]) -> None:
        """Project every tet below its bound, once forward and once backward over all tets, in place."""
        _project(points, self.tets, self.scale, self.bounds)

    def failures(self) -> NDArray[np.bool_]:
        """(m,) the tets that have, as measured last, less than `LEAST_SHARE` of their bound."""
        # Written so that NaN fails.
        least = np.where(self.bounds < FLATTEST, 1.0 - 1e-6, LEAST_SHARE) * self.bounds
        return (self.bounds > 0.0) & ~(least <= self.J)

    def accept(self) -> None:
        """Begin a substep at the positions that were measured last."""
        _set_bounds(self.J, self.guarded, self.bounds)


@njit(inline="always")
def _edges(points, a, b, d, e):
    ax, ay, az = points[a, 0], points[a, 1], points[a, 2]
    return (
        points[b, 0] - ax, points[b, 1] - ay, points[b, 2] - az,
        points[d, 0] - ax, points[d, 1] - ay, points[d, 2] - az,
        points[e, 0] - ax, points[e, 1] - ay, points[e, 2] - az,
    )  # fmt: skip


@njit
def _measure_block(points, tets, scale, bounds, share, out, low, high):
    below = 0
    for t in range(low, high):
        ux, uy, uz, vx, vy, vz, qx, qy, qz = _edges(points, tets[t, 0], tets[t, 1], tets[t, 2], tets[t, 3])
        det = ux * (vy * qz - vz * qy) + uy * (vz * qx - vx * qz) + uz * (vx * qy - vy * qx)
        J = det * scale[t]
        out[t] = J
        below += (share if bounds[t] > STRICT else 1.0) * bounds[t] > J
    return below


@njit(cache=True, parallel=True, rows=0)
def _measure(points, tets, scale, bounds, share, out):
    below = 0
    for block in prange((len(tets) + BLOCK - 1) // BLOCK):
        low = block * BLOCK
        below += _measure_block(points, tets, scale, bounds, share, out, low, min(low + BLOCK, len(tets)))
    return below


@njit(cache=True)
def _set_bounds(J, guarded, bounds):
    for t in range(len(J)):
        bounds[t] = min(J[t], max(ONSET, KEEP * J[t])) if guarded[t] else -np.inf


@njit(cache=True)
def _project(points, tets, scale, bounds):
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
