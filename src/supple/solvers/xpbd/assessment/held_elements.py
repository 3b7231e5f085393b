"""The elastic forces of bodies and stitches on vertices that a script or a pin holds."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from supple.materials.shells.hinges import add_hinge_forces, angles_of, turns_of
from supple.materials.shells.kernels import add_membrane_forces
from supple.model.system import System
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.assessment.elastic_energy import ElasticEnergy


class HeldElements(ElasticEnergy):
    """Tets and springs of bodies and stitches, and elements of shells and rods, with a node among `held` (n + a,).

    These are vertices, then anchors.
    """

    def __init__(self, system: System, held: NDArray[np.bool_]) -> None:
        stitches = system.stitching
        tets, springs = stitches.tets, stitches.springs
        near = held[tets.vertices].any(axis=1)
        self._stitch_tets = np.ascontiguousarray(tets.vertices[near], dtype=np.uint32)
        moduli = np.column_stack([tets.mu, tets.lam, np.zeros(len(tets))]) * tets.rest_volumes[:, None]
        self._stitch_data = np.hstack([tets.rest_shape_inverse.reshape(-1, 9), moduli])[near]
        super().__init__(system, held[: len(system.masses)])
        self._own = None
        if system.shells is not None and held[system.shells.triangles].any():
            shells = self._own = system.shells
            self._sheets, self._turning = (held[each].any(axis=1) for each in (shells.triangles, shells.hinges))
            near = self._sheets
            self._sheet_triangles, self._hinges = shells.triangles[near], shells.hinges[self._turning]
            self._membranes = shells.gradients[near], shells.laws[near]
        self._rods = system.rods if system.rods is not None and held[system.rods.nodes].any() else None
        near = held[springs.vertices].any(axis=1)
        laws = np.column_stack([springs.rest_lengths, springs.stiffness, np.zeros(len(springs))])
        # An edge is a spring to a vertex: to the place 0 of an edge of length zero.
        ends = np.concatenate([self._edges[:, [0, 1, 1]], springs.vertices[near].astype(np.uint32)])
        place = np.append(np.zeros(len(self._edges)), springs.place[near])
        self._all_springs = ends, np.column_stack([np.concatenate([self._springs, laws[near]]), place])

    def stiffness(self, count: int) -> NDArray[np.float64]:
        """(count,) of soft elements at rest against a displacement of each node [N/m]."""
        out, data = np.zeros(count), self._all_data
        B = data[:, :9].reshape(-1, 3, 3)
        b = np.concatenate([-B.sum(axis=1, keepdims=True), B], axis=1)
        np.add.at(out, self._all_tets, (2.0 * data[:, 9] + data[:, 10])[:, None] * np.einsum("tki,tki->tk", b, b))
        ends, springs = self._all_springs
        np.add.at(out, ends, springs[:, 1, None])
        if self._own is not None:
            np.add.at(out, self._sheet_triangles, self._own.stiffness[self._sheets])
        if self._rods is not None:
            np.add.at(out, self._rods.nodes, self._rods.section[:, None])
        return out

    def grow(self, Dm_inv: NDArray[np.float64], volumes: NDArray[np.float64]) -> None:
        """See `ElasticEnergy.grow`."""
        super().grow(Dm_inv, volumes)
        self._all_tets = np.concatenate([self._tets, self._stitch_tets])
        self._all_data = np.concatenate([self._data, self._stitch_data])

    def add_forces(self, points: NDArray[np.float64], h: float, factor: float, out: NDArray[np.float64]) -> None:
        """Add `factor` times the forces on all nodes at points (n + a, >= 3) to `out` (n + a, 3) [N].

        Hard constraints are as stiff as in substeps of h [s], see `ElasticEnergy`.
        """
        _add_forces_of_tets(points, self._all_tets, self._all_data, 1.0 / h**2, factor, out)
        _add_forces_of_springs(points, *self._all_springs, 1.0 / h**2, factor, out)
        if self._own is not None:
            moments = self._own.moments(angles_of(points, self._own.hinges) - self._own.rest_angles)
            add_membrane_forces(points, self._sheet_triangles, *self._membranes, factor, out)
            turns = turns_of(points, self._hinges)
            add_hinge_forces(turns, self._hinges, -factor * moments[self._turning], out)
        if self._rods is not None:
            x, pushes = points[:, :3], np.zeros((len(points), 3))
            self._rods.add_elastic_gradient(x, pushes)
            out -= factor * pushes


@njit(cache=True)
def _add_forces_of_tets(points, tets, data, hard, factor, out):
    """Minus V P Dm^-T of each tet, with P = mu F + (lam (J - 1) - mu) dJ/dF."""
    D, F, P = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    for t in range(len(tets)):
        B = data[t, :9].reshape(3, 3)
        for i in range(3):
            for k in range(3):
                D[i, k] = points[tets[t, k + 1], i] - points[tets[t, 0], i]
        for i in range(3):
            for k in range(3):
                F[i, k] = D[i, 0] * B[0, k] + D[i, 1] * B[1, k] + D[i, 2] * B[2, k]
        for i in range(3):
            for k in range(3):
                a, b, c, d = (i + 1) % 3, (i + 2) % 3, (k + 1) % 3, (k + 2) % 3
                P[i, k] = F[a, c] * F[b, d] - F[a, d] * F[b, c]
        J = F[0, 0] * P[0, 0] + F[0, 1] * P[0, 1] + F[0, 2] * P[0, 2]
        mu = data[t, 9]
        pressure = (data[t, 10] + hard * data[t, 11]) * (J - 1.0) - mu
        for i in range(3):
            for k in range(3):
                P[i, k] = mu * F[i, k] + pressure * P[i, k]
        for i in range(3):
            for k in range(3):
                force = -factor * (P[i, 0] * B[k, 0] + P[i, 1] * B[k, 1] + P[i, 2] * B[k, 2])
                out[tets[t, k + 1], i] += force
                out[tets[t, 0], i] -= force


@njit(cache=True)
def _add_forces_of_springs(points, ends, springs, hard, factor, out):
    """Of springs from a vertex to a place of an edge: rest length, stiffness, hard stiffness and place."""
    d = np.empty(3)
    for k in range(len(ends)):
        a, b, c, t = ends[k, 0], ends[k, 1], ends[k, 2], springs[k, 3]
        for i in range(3):
            d[i] = points[a, i] - (1.0 - t) * points[b, i] - t * points[c, i]
        length = math.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        if length > 0.0:  # coinciding ends have no direction
            pull = factor * (springs[k, 1] + hard * springs[k, 2]) * (springs[k, 0] / length - 1.0)
            for i in range(3):
                out[a, i] += pull * d[i]
                out[b, i] -= (1.0 - t) * pull * d[i]
                out[c, i] -= t * pull * d[i]
