"""The classic constraint set: C = |x1 - x2| - l on edges, C = V - V0 on tetrahedra, each with a compliance.

One projection with the multiplier starting at 0 and Kelvin-Voigt damping (gamma = tau / h, see docs/xpbd.md):

    dlam = -(C + gamma (C - C_n)) / ((1 + gamma) sum w |grad C|^2 + alpha / h^2),    dx_i = w_i grad_i C dlam

with C_n the constraint at the beginning of the substep. C - C_n, and not grad C . (x - x_n): the two agree to first
order, but the first is exactly zero in a rigid rotation.

Source: Macklin, Müller, Chentanez, "XPBD" (2016), equations 18 and 26.
"""

from __future__ import annotations

import math
from typing import cast

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from supple.materials.edges_and_volume import EdgesAndVolume
from supple.system import BodyRange, System
from supple.xpbd.ordering import Layout
from supple.xpbd.segments import Segments, gather, sort_into_segments

# No flag that assumes finite numbers (NaN must be seen) and none that reorders sums (same bits for any thread count).
FLAGS = {"contract", "arcp", "nsz"}


class EdgeConstraints:
    """The edges of all bodies made of `EdgesAndVolume`."""

    def __init__(self, system: System, parts: list[BodyRange], layout: Layout) -> None:
        rows, kind, self.table = gather(parts, "edges", [(m.edge_compliance, m.damping) for m in _materials(parts)])
        movable = (system.inverse_masses[system.edges[rows]] > 0.0).any(axis=1)
        rows, kind = rows[movable], kind[movable]
        self.segments = sort_into_segments(layout, system.edges[rows], kind)
        rows = rows[self.segments.order]
        # Unsigned indices spare the kernel the test for Python's negative ones.
        self.ends = np.ascontiguousarray(system.edges[rows], dtype=np.uint32)
        self.rest = np.ascontiguousarray(system.rest_lengths[rows])
        self.count = len(rows)

    def project(self, points: NDArray[np.float64], previous: NDArray[np.float64], h: float, parallel: bool) -> None:
        """See `ConstraintSet.project`."""
        sweep = _sweep_edges_parallel if parallel else _sweep_edges
        sweep(points, previous, self.ends, self.rest, *_scaled(self.segments, self.table, h, 1.0))


class VolumeConstraints:
    """The tetrahedra of all bodies made of `EdgesAndVolume`. Volumes are kept as determinants, 6 V."""

    def __init__(self, system: System, parts: list[BodyRange], layout: Layout) -> None:
        rows, kind, self.table = gather(parts, "tets", [(m.volume_compliance, m.damping) for m in _materials(parts)])
        movable = (system.inverse_masses[system.tets[rows]] > 0.0).any(axis=1)
        rows, kind = rows[movable], kind[movable]
        self.segments = sort_into_segments(layout, system.tets[rows], kind)
        rows = rows[self.segments.order]
        self.corners = np.ascontiguousarray(system.tets[rows], dtype=np.uint32)
        self.rest = np.ascontiguousarray(6.0 * system.rest_volumes[rows])
        self.count = len(rows)

    def project(self, points: NDArray[np.float64], previous: NDArray[np.float64], h: float, parallel: bool) -> None:
        """See `ConstraintSet.project`."""
        sweep = _sweep_volumes_parallel if parallel else _sweep_volumes
        # The energy C^2 / (2 alpha) of C = V - V0 is that of 6 C with 36 alpha.
        sweep(points, previous, self.corners, self.rest, *_scaled(self.segments, self.table, h, 36.0))


def _materials(parts: list[BodyRange]) -> list[EdgesAndVolume]:
    return [cast(EdgesAndVolume, part.body.material) for part in parts]


def _scaled(segments: Segments, table: NDArray, h: float, unit: float) -> tuple[NDArray, NDArray, NDArray]:
    """The segments as the kernels want them: chunk pointers, bounds, and (alpha / h^2, tau / h) of each segment."""
    constants = table[segments.kinds] * np.array([unit / h**2, 1.0 / h])
    return segments.chunk_pointers, segments.bounds, np.ascontiguousarray(constants)


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def _edges_of_chunk(points, previous, ends, rest, first, last, bounds, constants):
    for s in range(first, last):
        alpha = constants[s, 0]
        gamma = constants[s, 1]
        grown = 1.0 + gamma
        for c in range(bounds[s, 0], bounds[s, 1]):
            i, j = ends[c, 0], ends[c, 1]
            dx = points[i, 0] - points[j, 0]
            dy = points[i, 1] - points[j, 1]
            dz = points[i, 2] - points[j, 2]
            wi, wj = points[i, 3], points[j, 3]
            length = math.sqrt(dx * dx + dy * dy + dz * dz)
            C = length - rest[c]
            if gamma > 0.0:
                px = previous[i, 0] - previous[j, 0]
                py = previous[i, 1] - previous[j, 1]
                pz = previous[i, 2] - previous[j, 2]
                C += gamma * (length - math.sqrt(px * px + py * py + pz * pz))
            # Coinciding ends have no direction to part in; others will move them.
            if length == 0.0:
                continue
            dlam = -C / ((grown * (wi + wj) + alpha) * length)
            a, b = wi * dlam, wj * dlam
            points[i, 0] += a * dx
            points[i, 1] += a * dy
            points[i, 2] += a * dz
            points[j, 0] -= b * dx
            points[j, 1] -= b * dy
            points[j, 2] -= b * dz


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def _volumes_of_chunk(points, previous, corners, rest, first, last, bounds, constants):
    for s in range(first, last):
        alpha = constants[s, 0]
        gamma = constants[s, 1]
        grown = 1.0 + gamma
        for c in range(bounds[s, 0], bounds[s, 1]):
            a, b, d, e = corners[c, 0], corners[c, 1], corners[c, 2], corners[c, 3]
            ax, ay, az, wa = points[a, 0], points[a, 1], points[a, 2], points[a, 3]
            bx, by, bz, wb = points[b, 0], points[b, 1], points[b, 2], points[b, 3]
            dx, dy, dz, wd = points[d, 0], points[d, 1], points[d, 2], points[d, 3]
            ex, ey, ez, we = points[e, 0], points[e, 1], points[e, 2], points[e, 3]
            ux, uy, uz = bx - ax, by - ay, bz - az
            vx, vy, vz = dx - ax, dy - ay, dz - az
            qx, qy, qz = ex - ax, ey - ay, ez - az
            gbx, gby, gbz = vy * qz - vz * qy, vz * qx - vx * qz, vx * qy - vy * qx
            gdx, gdy, gdz = qy * uz - qz * uy, qz * ux - qx * uz, qx * uy - qy * ux
            gex, gey, gez = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            gax, gay, gaz = -gbx - gdx - gex, -gby - gdy - gey, -gbz - gdz - gez
            det = gbx * ux + gby * uy + gbz * uz
            C = det - rest[c]
            if gamma > 0.0:
                C += gamma * (det - _determinant(previous, a, b, d, e))
            slope = (
                wa * (gax * gax + gay * gay + gaz * gaz)
                + wb * (gbx * gbx + gby * gby + gbz * gbz)
                + wd * (gdx * gdx + gdy * gdy + gdz * gdz)
                + we * (gex * gex + gey * gey + gez * gez)
            )
            # All four in a line: no direction changes the volume.
            if slope == 0.0:
                continue
            dlam = -C / (grown * slope + alpha)
            sa, sb, sd, se = wa * dlam, wb * dlam, wd * dlam, we * dlam
            points[a, 0] = ax + sa * gax
            points[a, 1] = ay + sa * gay
            points[a, 2] = az + sa * gaz
            points[b, 0] = bx + sb * gbx
            points[b, 1] = by + sb * gby
            points[b, 2] = bz + sb * gbz
            points[d, 0] = dx + sd * gdx
            points[d, 1] = dy + sd * gdy
            points[d, 2] = dz + sd * gdz
            points[e, 0] = ex + se * gex
            points[e, 1] = ey + se * gey
            points[e, 2] = ez + se * gez


@njit(cache=True, fastmath=FLAGS)
def _determinant(x, a, b, d, e):
    ux, uy, uz = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
    vx, vy, vz = x[d, 0] - x[a, 0], x[d, 1] - x[a, 1], x[d, 2] - x[a, 2]
    qx, qy, qz = x[e, 0] - x[a, 0], x[e, 1] - x[a, 1], x[e, 2] - x[a, 2]
    return ux * (vy * qz - vz * qy) + uy * (vz * qx - vx * qz) + uz * (vx * qy - vy * qx)


@njit(cache=True)
def _sweep_edges(points, previous, ends, rest, pointers, bounds, constants):
    n_chunks = len(pointers) - 1
    for parity in range(2):
        for c in range(parity, n_chunks, 2):
            _edges_of_chunk(points, previous, ends, rest, pointers[c], pointers[c + 1], bounds, constants)


@njit(cache=True, parallel=True)
def _sweep_edges_parallel(points, previous, ends, rest, pointers, bounds, constants):
    n_chunks = len(pointers) - 1
    for parity in range(2):
        for k in prange((n_chunks + 1 - parity) // 2):
            c = 2 * k + parity
            _edges_of_chunk(points, previous, ends, rest, pointers[c], pointers[c + 1], bounds, constants)


@njit(cache=True)
def _sweep_volumes(points, previous, corners, rest, pointers, bounds, constants):
    n_chunks = len(pointers) - 1
    for parity in range(2):
        for c in range(parity, n_chunks, 2):
            _volumes_of_chunk(points, previous, corners, rest, pointers[c], pointers[c + 1], bounds, constants)


@njit(cache=True, parallel=True)
def _sweep_volumes_parallel(points, previous, corners, rest, pointers, bounds, constants):
    n_chunks = len(pointers) - 1
    for parity in range(2):
        for k in prange((n_chunks + 1 - parity) // 2):
            c = 2 * k + parity
            _volumes_of_chunk(points, previous, corners, rest, pointers[c], pointers[c + 1], bounds, constants)
