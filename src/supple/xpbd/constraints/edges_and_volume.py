"""The classic constraint set: C = |x1 - x2| - l on edges, C = V - V0 on tetrahedra, each with a compliance.

One projection with the multiplier starting at 0, and one of the damping with gamma = tau / h (see docs/xpbd.md):

    dlam = -C / (sum w |grad C|^2 + alpha / h^2),    dx_i = w_i grad_i C dlam
    dlam = -gamma (C - C_n) / (gamma sum w |grad C|^2 + alpha / h^2)

with C_n the constraint at the beginning of the substep. C - C_n is used instead of grad C . (x - x_n): they agree to
first order, but only the former is exactly zero in a rigid rotation.

Source: Macklin, Müller, Chentanez, "XPBD" (2016), equations 18 and 26.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from supple.errors import SolverError
from supple.numerics.kernel_cache import njit, prange
from supple.system import BodyRange, System
from supple.xpbd.sweeps.compilation import FLAGS, SerialAndParallel, serial_and_parallel
from supple.xpbd.sweeps.ordering import Layout
from supple.xpbd.sweeps.segments import gather, sort_into_segments


class _Constraints:
    """One constraint on each edge or on each tet (`which`) of some bodies, with the compliance of this name.

    Attributes
    ----------
    rest : (m,) of each constraint; unit : factor of the compliance
    sweep, damping_sweep : the kernels
    """

    rest: NDArray[np.float64]
    unit: float
    sweep: SerialAndParallel
    damping_sweep: SerialAndParallel

    def __init__(self, system: System, parts: list[BodyRange], layout: Layout, which: str, compliance: str) -> None:
        vertices: NDArray[np.int32] = getattr(system, which)
        rows, kind, self.table = gather(parts, which, [_constants(part, compliance) for part in parts])
        movable = (system.inverse_masses[vertices[rows]] > 0.0).any(axis=1)
        rows, kind = rows[movable], kind[movable]
        self.segments = sort_into_segments(layout, vertices[rows], kind)
        self.rows = rows[self.segments.order]
        # With unsigned indices the kernel needs no test for negative ones.
        self.vertices = np.ascontiguousarray(vertices[self.rows], dtype=np.uint32)
        self.count = self.work = len(rows)
        self.damped = bool(self.table[:, 1].any())

    def project(self, points: NDArray[np.float64], h: float, parallel: bool) -> None:
        """See `ConstraintSet.project`."""
        self.sweep[parallel](points, self.vertices, self.rest, *self._scaled(h))

    def damp(self, points: NDArray[np.float64], previous: NDArray[np.float64], h: float, parallel: bool) -> None:
        """See `ConstraintSet.damp`."""
        self.damping_sweep[parallel](points, previous, self.vertices, *self._scaled(h))

    def _scaled(self, h: float) -> tuple[NDArray, NDArray, NDArray]:
        """The arguments of the kernels: chunk pointers, bounds, and (alpha / h^2, tau / h) of each segment."""
        constants = self.table[self.segments.kinds] * np.array([self.unit / h**2, 1.0 / h])
        return self.segments.chunk_pointers, self.segments.bounds, np.ascontiguousarray(constants)


class EdgeConstraints(_Constraints):
    """The edges of all bodies made of `EdgesAndVolume`."""

    def __init__(self, system: System, parts: list[BodyRange], layout: Layout) -> None:
        super().__init__(system, parts, layout, "edges", "edge_compliance")
        self.rest = np.ascontiguousarray(system.rest_lengths[self.rows])
        self.unit, self.sweep, self.damping_sweep = 1.0, _sweep_edges, _damp_edges


class VolumeConstraints(_Constraints):
    """The tetrahedra of all bodies made of `EdgesAndVolume`. Volumes are stored as determinants, 6 V."""

    def __init__(self, system: System, parts: list[BodyRange], layout: Layout) -> None:
        super().__init__(system, parts, layout, "tets", "volume_compliance")
        self.rest = np.ascontiguousarray(6.0 * system.rest_volumes[self.rows])
        # The energy C^2 / (2 alpha) of C = V - V0 is that of 6 C with 36 alpha.
        self.unit, self.sweep, self.damping_sweep = 36.0, _sweep_volumes, _damp_volumes


def _constants(part: BodyRange, compliance: str) -> NDArray[np.float64]:
    """A compliance and the damping time of a body, (2,)."""
    material = part.body.material
    if np.ndim(material.damping):
        raise SolverError(
            f"XPBD: body {part.name!r}: EdgesAndVolume needs one damping for the whole body; give a number"
        )
    return np.array([getattr(material, compliance), material.damping], dtype=np.float64)


@njit(cache=True, fastmath=FLAGS)
def _determinant(x, a, b, d, e):
    ux, uy, uz = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
    vx, vy, vz = x[d, 0] - x[a, 0], x[d, 1] - x[a, 1], x[d, 2] - x[a, 2]
    qx, qy, qz = x[e, 0] - x[a, 0], x[e, 1] - x[a, 1], x[e, 2] - x[a, 2]
    return ux * (vy * qz - vz * qy) + uy * (vz * qx - vx * qz) + uz * (vx * qy - vy * qx)


@njit(fastmath=FLAGS, error_model="numpy", inline="always")
def _length(x, i, j):
    dx, dy, dz = x[i, 0] - x[j, 0], x[i, 1] - x[j, 1], x[i, 2] - x[j, 2]
    return math.sqrt(dx * dx + dy * dy + dz * dz)


@njit(fastmath=FLAGS, error_model="numpy", inline="always")
def _project_edge(points, i, j, target, gamma, alpha):
    """dlam = -gamma (C - target) / (gamma sum w |grad C|^2 + alpha) with the length C of the edge i j."""
    dx, dy, dz = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1], points[i, 2] - points[j, 2]
    wi, wj = points[i, 3], points[j, 3]
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    # Coinciding ends define no direction; other constraints move them.
    if length > 0.0:
        dlam = gamma * (target - length) / ((gamma * (wi + wj) + alpha) * length)
        a, b = wi * dlam, wj * dlam
        points[i, 0] += a * dx
        points[i, 1] += a * dy
        points[i, 2] += a * dz
        points[j, 0] -= b * dx
        points[j, 1] -= b * dy
        points[j, 2] -= b * dz


@njit(fastmath=FLAGS, error_model="numpy", inline="always")
def _project_volume(points, a, b, d, e, target, gamma, alpha):
    """The same with the determinant C, 6 V, of the tet a b d e."""
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
    # Where all four are in a line, no direction changes the volume.
    if slope > 0.0:
        dlam = gamma * (target - det) / (gamma * slope + alpha)
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
def _project_edges(points, ends, rest, first, last, bounds, constants):
    for s in range(first, last):
        alpha = constants[s, 0]
        for c in range(bounds[s, 0], bounds[s, 1]):
            _project_edge(points, ends[c, 0], ends[c, 1], rest[c], 1.0, alpha)


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def _damp_edges_of_chunk(points, previous, ends, first, last, bounds, constants, backwards):
    for s in range(last - 1, first - 1, -1) if backwards else range(first, last):
        alpha = constants[s, 0]
        gamma = 0.5 * constants[s, 1]  # half in each of the two sweeps
        low, high = bounds[s, 0], bounds[s, 1]
        if gamma == 0.0:
            continue
        for k in range(high - low):
            c = high - 1 - k if backwards else low + k
            i, j = ends[c, 0], ends[c, 1]
            _project_edge(points, i, j, _length(previous, i, j), gamma, alpha)


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def _project_volumes(points, corners, rest, first, last, bounds, constants):
    for s in range(first, last):
        alpha = constants[s, 0]
        for c in range(bounds[s, 0], bounds[s, 1]):
            _project_volume(points, corners[c, 0], corners[c, 1], corners[c, 2], corners[c, 3], rest[c], 1.0, alpha)


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def _damp_volumes_of_chunk(points, previous, corners, first, last, bounds, constants, backwards):
    for s in range(last - 1, first - 1, -1) if backwards else range(first, last):
        alpha = constants[s, 0]
        gamma = 0.5 * constants[s, 1]  # half in each of the two sweeps
        low, high = bounds[s, 0], bounds[s, 1]
        if gamma == 0.0:
            continue
        for k in range(high - low):
            c = high - 1 - k if backwards else low + k
            a, b, d, e = corners[c, 0], corners[c, 1], corners[c, 2], corners[c, 3]
            _project_volume(points, a, b, d, e, _determinant(previous, a, b, d, e), gamma, alpha)


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
        # even, odd, then backward: odd, even
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
        # even, odd, then backward: odd, even
        parity = 0 if turn == 0 or turn == 3 else 1
        for k in prange((n_chunks + 1 - parity) // 2):
            c = 2 * k + parity
            first, last = pointers[c], pointers[c + 1]
            _damp_volumes_of_chunk(points, previous, corners, first, last, bounds, constants, turn >= 2)
