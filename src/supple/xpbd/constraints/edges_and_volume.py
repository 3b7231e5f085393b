"""The classic constraint set: C = |x1 - x2| - l on edges, C = V - V0 on tetrahedra, each with a compliance.

One projection with the multiplier starting at 0, and one of the damping with gamma = tau / h (see docs/xpbd.md):

    dlam = -C / (sum w |grad C|^2 + alpha / h^2),    dx_i = w_i grad_i C dlam
    dlam = -gamma (C - C_n) / (gamma sum w |grad C|^2 + alpha / h^2)

with C_n the constraint at the beginning of the substep. C - C_n, and not grad C . (x - x_n): the two agree to first
order, but the first is exactly zero in a rigid rotation.

Source: Macklin, Müller, Chentanez, "XPBD" (2016), equations 18 and 26.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from supple.errors import SolverError
from supple.numerics.kernel_cache import njit, prange
from supple.system import BodyRange, System
from supple.xpbd.sweeps.compilation import FLAGS, serial_and_parallel
from supple.xpbd.sweeps.ordering import Layout
from supple.xpbd.sweeps.segments import Segments, gather, sort_into_segments


class EdgeConstraints:
    """The edges of all bodies made of `EdgesAndVolume`."""

    def __init__(self, system: System, parts: list[BodyRange], layout: Layout) -> None:
        rows, kind, self.table = gather(parts, "edges", [_constants(part, "edge_compliance") for part in parts])
        movable = (system.inverse_masses[system.edges[rows]] > 0.0).any(axis=1)
        rows, kind = rows[movable], kind[movable]
        self.segments = sort_into_segments(layout, system.edges[rows], kind)
        rows = rows[self.segments.order]
        # Unsigned indices spare the kernel the test for Python's negative ones.
        self.ends = np.ascontiguousarray(system.edges[rows], dtype=np.uint32)
        self.rest = np.ascontiguousarray(system.rest_lengths[rows])
        self.count = self.work = len(rows)
        self.damped = bool(self.table[:, 1].any())

    def project(self, points: NDArray[np.float64], h: float, parallel: bool) -> None:
        """See `ConstraintSet.project`."""
        _sweep_edges[parallel](points, self.ends, self.rest, *_scaled(self.segments, self.table, h, 1.0))

    def damp(self, points: NDArray[np.float64], previous: NDArray[np.float64], h: float, parallel: bool) -> None:
        """See `ConstraintSet.damp`."""
        _damp_edges[parallel](points, previous, self.ends, *_scaled(self.segments, self.table, h, 1.0))


class VolumeConstraints:
    """The tetrahedra of all bodies made of `EdgesAndVolume`. Volumes are kept as determinants, 6 V."""

    def __init__(self, system: System, parts: list[BodyRange], layout: Layout) -> None:
        rows, kind, self.table = gather(parts, "tets", [_constants(part, "volume_compliance") for part in parts])
        movable = (system.inverse_masses[system.tets[rows]] > 0.0).any(axis=1)
        rows, kind = rows[movable], kind[movable]
        self.segments = sort_into_segments(layout, system.tets[rows], kind)
        rows = rows[self.segments.order]
        self.corners = np.ascontiguousarray(system.tets[rows], dtype=np.uint32)
        self.rest = np.ascontiguousarray(6.0 * system.rest_volumes[rows])
        self.count = self.work = len(rows)
        self.damped = bool(self.table[:, 1].any())

    def project(self, points: NDArray[np.float64], h: float, parallel: bool) -> None:
        """See `ConstraintSet.project`."""
        # The energy C^2 / (2 alpha) of C = V - V0 is that of 6 C with 36 alpha.
        _sweep_volumes[parallel](points, self.corners, self.rest, *_scaled(self.segments, self.table, h, 36.0))

    def damp(self, points: NDArray[np.float64], previous: NDArray[np.float64], h: float, parallel: bool) -> None:
        """See `ConstraintSet.damp`."""
        _damp_volumes[parallel](points, previous, self.corners, *_scaled(self.segments, self.table, h, 36.0))


def _constants(part: BodyRange, compliance: str) -> NDArray[np.float64]:
    """A compliance and the damping time of a body."""
    material = part.body.material
    if np.ndim(material.damping):
        raise SolverError(
            f"XPBD: body {part.name!r}: EdgesAndVolume needs one damping for the whole body; give a number"
        )
    return np.array([getattr(material, compliance), material.damping], dtype=np.float64)


def _scaled(segments: Segments, table: NDArray, h: float, unit: float) -> tuple[NDArray, NDArray, NDArray]:
    """The segments as the kernels want them: chunk pointers, bounds, and (alpha / h^2, tau / h) of each segment."""
    constants = table[segments.kinds] * np.array([unit / h**2, 1.0 / h])
    return segments.chunk_pointers, segments.bounds, np.ascontiguousarray(constants)


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def _project_edges(points, ends, rest, first, last, bounds, constants):
    for s in range(first, last):
        alpha = constants[s, 0]
        for c in range(bounds[s, 0], bounds[s, 1]):
            i, j = ends[c, 0], ends[c, 1]
            dx = points[i, 0] - points[j, 0]
            dy = points[i, 1] - points[j, 1]
            dz = points[i, 2] - points[j, 2]
            wi, wj = points[i, 3], points[j, 3]
            length = math.sqrt(dx * dx + dy * dy + dz * dz)
            # Coinciding ends have no direction to part in; others will move them.
            if length == 0.0:
                continue
            dlam = (rest[c] - length) / ((wi + wj + alpha) * length)
            a, b = wi * dlam, wj * dlam
            points[i, 0] += a * dx
            points[i, 1] += a * dy
            points[i, 2] += a * dz
            points[j, 0] -= b * dx
            points[j, 1] -= b * dy
            points[j, 2] -= b * dz


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def _damp_edges_of_chunk(points, previous, ends, first, last, bounds, constants, backwards):
    for s in range(last - 1, first - 1, -1) if backwards else range(first, last):
        alpha = constants[s, 0]
        gamma = 0.5 * constants[s, 1]  # half of it in each of the two sweeps
        low, high = bounds[s, 0], bounds[s, 1]
        if gamma == 0.0:
            continue
        for k in range(high - low):
            c = high - 1 - k if backwards else low + k
            i, j = ends[c, 0], ends[c, 1]
            dx = points[i, 0] - points[j, 0]
            dy = points[i, 1] - points[j, 1]
            dz = points[i, 2] - points[j, 2]
            ux = previous[i, 0] - previous[j, 0]
            uy = previous[i, 1] - previous[j, 1]
            uz = previous[i, 2] - previous[j, 2]
            wi, wj = points[i, 3], points[j, 3]
            length = math.sqrt(dx * dx + dy * dy + dz * dz)
            if length == 0.0:
                continue
            C = length - math.sqrt(ux * ux + uy * uy + uz * uz)
            dlam = -gamma * C / ((gamma * (wi + wj) + alpha) * length)
            a, b = wi * dlam, wj * dlam
            points[i, 0] += a * dx
            points[i, 1] += a * dy
            points[i, 2] += a * dz
            points[j, 0] -= b * dx
            points[j, 1] -= b * dy
            points[j, 2] -= b * dz


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def _project_volumes(points, corners, rest, first, last, bounds, constants):
    for s in range(first, last):
        alpha = constants[s, 0]
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
            slope = (
                wa * (gax * gax + gay * gay + gaz * gaz)
                + wb * (gbx * gbx + gby * gby + gbz * gbz)
                + wd * (gdx * gdx + gdy * gdy + gdz * gdz)
                + we * (gex * gex + gey * gey + gez * gez)
            )
            # All four in a line: no direction changes the volume.
            if slope == 0.0:
                continue
            dlam = (rest[c] - det) / (slope + alpha)
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


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def _damp_volumes_of_chunk(points, previous, corners, first, last, bounds, constants, backwards):
    for s in range(last - 1, first - 1, -1) if backwards else range(first, last):
        alpha = constants[s, 0]
        gamma = 0.5 * constants[s, 1]  # half of it in each of the two sweeps
        low, high = bounds[s, 0], bounds[s, 1]
        if gamma == 0.0:
            continue
        for k in range(high - low):
            c = high - 1 - k if backwards else low + k
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
            C = det - _determinant(previous, a, b, d, e)
            slope = (
                wa * (gax * gax + gay * gay + gaz * gaz)
                + wb * (gbx * gbx + gby * gby + gbz * gbz)
                + wd * (gdx * gdx + gdy * gdy + gdz * gdz)
                + we * (gex * gex + gey * gey + gez * gez)
            )
            # All four in a line: no direction changes the volume.
            if slope == 0.0:
                continue
            dlam = -gamma * C / (gamma * slope + alpha)
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


@serial_and_parallel
def _sweep_edges(points, ends, rest, pointers, bounds, constants):
    n_chunks = len(pointers) - 1
    for parity in range(2):
        for k in prange((n_chunks + 1 - parity) // 2):
            c = 2 * k + parity
            _project_edges(points, ends, rest, pointers[c], pointers[c + 1], bounds, constants)


@serial_and_parallel
def _damp_edges(points, previous, ends, pointers, bounds, constants):
    n_chunks = len(pointers) - 1
    for turn in range(4):
        # even, odd, and back: odd, even
        parity = 0 if turn == 0 or turn == 3 else 1
        for k in prange((n_chunks + 1 - parity) // 2):
            c = 2 * k + parity
            first, last = pointers[c], pointers[c + 1]
            _damp_edges_of_chunk(points, previous, ends, first, last, bounds, constants, turn >= 2)


@serial_and_parallel
def _sweep_volumes(points, corners, rest, pointers, bounds, constants):
    n_chunks = len(pointers) - 1
    for parity in range(2):
        for k in prange((n_chunks + 1 - parity) // 2):
            c = 2 * k + parity
            _project_volumes(points, corners, rest, pointers[c], pointers[c + 1], bounds, constants)


@serial_and_parallel
def _damp_volumes(points, previous, corners, pointers, bounds, constants):
    n_chunks = len(pointers) - 1
    for turn in range(4):
        # even, odd, and back: odd, even
        parity = 0 if turn == 0 or turn == 3 else 1
        for k in prange((n_chunks + 1 - parity) // 2):
            c = 2 * k + parity
            first, last = pointers[c], pointers[c + 1]
            _damp_volumes_of_chunk(points, previous, corners, first, last, bounds, constants, turn >= 2)
