"""The elastic energy of the bodies, from which a frame's balance of energy is made."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic import EdgesAndVolume
from supple.materials.material import Elastic
from supple.materials.shells.elements import ShellElements
from supple.materials.shells.hinges import angles_of
from supple.materials.shells.kernels import membrane_energies
from supple.model.system import System
from supple.runtime.kernel_cache import njit, prange

BLOCK = 1024


class ElasticEnergy:
    """The energies of XPBD's two materials on any of a system's tets and edges.

    A hard constraint, of compliance zero, has none; but one that is violated can give out at most
    C^2 / (2 h^2 sum w |grad C|^2) in a substep of h, the kinetic energy after its projection.

    Attributes
    ----------
    has_hard : whether there are hard constraints

    Parameters
    ----------
    system : in the numbering of the points that `of` receives
    vertices : (n,) bool; only elements with one of these vertices are in the sum. None: all.
    """

    def __init__(self, system: System, vertices: NDArray[np.bool_] | None = None) -> None:
        m, e = len(system.tets), len(system.edges)
        # Of each tet: the density mu/2 (tr F^T F - 3) - mu (J - 1) + lam/2 (J - 1)^2, with mu = 0 for EdgesAndVolume.
        mu, lam, stiffness = np.zeros(m), np.zeros(m), np.zeros(e)
        hard_lam, hard_stiffness = np.zeros(m), np.zeros(e)  # times h^2
        for part in system.bodies:
            material, volumes = part.body.material, system.rest_volumes[part.tets]
            if isinstance(material, EdgesAndVolume):
                # C^2 / (2 alpha) with C = V (J - 1).
                if material.volume_compliance > 0.0:
                    lam[part.tets] = volumes / material.volume_compliance
                else:
                    hard_lam[part.tets] = _inverse(_volume_slopes(system, part.tets)) / volumes
                if material.edge_compliance > 0.0:
                    stiffness[part.edges] = 1.0 / material.edge_compliance
                else:
                    slopes = system.inverse_masses[system.edges[part.edges]].sum(axis=1)
                    hard_stiffness[part.edges] = _inverse(slopes)
            elif isinstance(material, Elastic) and not part.rigid:
                each = material.per_tet(len(volumes))
                mu[part.tets], lam[part.tets] = each.mu, each.lam
        tets, edges = (mu > 0.0) | (lam > 0.0) | (hard_lam > 0.0), (stiffness > 0.0) | (hard_stiffness > 0.0)
        if vertices is not None:
            tets &= vertices[system.tets].any(axis=1)
            edges &= vertices[system.edges].any(axis=1)
        self.has_hard = bool((hard_lam > 0.0).any() or (hard_stiffness > 0.0).any())
        self._tets = np.ascontiguousarray(system.tets[tets], dtype=np.uint32)
        self._rows, self._moduli = np.flatnonzero(tets), np.column_stack([mu, lam, hard_lam])[tets]
        self.grow(system.rest_shape_inverse, system.rest_volumes)
        self._edges = np.ascontiguousarray(system.edges[edges], dtype=np.uint32)
        self._springs = np.column_stack([system.rest_lengths[edges], stiffness[edges], hard_stiffness[edges]])
        self._of_tets, self._of_edges = np.zeros(len(self._tets)), np.zeros(len(self._edges))
        starts = [part.tets.start for part in system.bodies], [part.edges.start for part in system.bodies]
        self._tet_starts = np.searchsorted(np.flatnonzero(tets), starts[0])
        self._edge_starts = np.searchsorted(np.flatnonzero(edges), starts[1])
        self._shells = system.shells if vertices is None else None
        if self._shells is not None:
            first = [part.vertices.start for part in system.bodies]
            self._bodies = [
                np.searchsorted(first, elements[:, 0], side="right") - 1
                for elements in (self._shells.triangles, self._shells.hinges)
            ]

        self._rods = system.rods if vertices is None else None
        if self._rods is not None:
            first = [part.vertices.start for part in system.bodies]
            edges = np.searchsorted(first, self._rods.nodes[:, 0], side="right") - 1
            self._of_rods = edges, edges[self._rods.joints[:, 0]]

    def grow(self, Dm_inv: NDArray[np.float64], volumes: NDArray[np.float64]) -> None:
        """Take other stress-free shapes of all tets of the system: (m, 3, 3) [1/m], (m,) [m^3]."""
        shapes = Dm_inv[self._rows].reshape(-1, 9)
        self._data = np.hstack([shapes, self._moduli * volumes[self._rows, None]])

    def of(self, points: NDArray[np.float64], h: float = math.inf) -> NDArray[np.float64]:
        """Energy of each body (b,) at points (n, 3 or more columns) [J], zero at rest.

        With what hard constraints can give out in substeps of `h` [s], where that is finite.
        """
        _energies_of_tets(points, self._tets, self._data, 1.0 / h**2, self._of_tets)
        if len(self._edges):
            _energies_of_edges(points, self._edges, self._springs, 1.0 / h**2, self._of_edges)
        total = _sums(self._of_tets, self._tet_starts) + _sums(self._of_edges, self._edge_starts)
        if self._shells is not None:
            for own, energies in zip(self._bodies, energies_of_shells(self._shells, points), strict=True):
                total += np.bincount(own, energies, len(total))
        if self._rods is not None:
            x = points[:, :3]
            stored = (
                self._rods.edge_energies(x, self._rods.stretches(x)),
                self._rods.joint_energies(self._rods.bends(x)),
            )
            for own, energies in zip(self._of_rods, stored, strict=True):
                total += np.bincount(own, energies, len(total))
        return total


def energies_of_shells(shells: ShellElements, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    """The energies of the triangles (t,), and of the hinges (e,), at places x (n, >= 3) [J]."""
    stretched = np.zeros(len(shells.triangles))
    membrane_energies(x, shells.triangles, shells.gradients, shells.laws, stretched)
    turned = angles_of(x, shells.hinges) - shells.rest_angles
    return stretched, 0.5 * turned * shells.moments(turned)


def _inverse(slopes: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k,) of the slopes; 0 where nothing can move, so that nothing is given out."""
    return np.divide(1.0, slopes, out=np.zeros_like(slopes), where=slopes > 0.0)


def _volume_slopes(system: System, tets: slice) -> NDArray[np.float64]:
    """(m,) sum of w |grad C|^2 of C = V (J - 1) at rest, over the square of the volume."""
    Dm_inv = system.rest_shape_inverse[tets]
    b = np.concatenate([-Dm_inv.sum(axis=1, keepdims=True), Dm_inv], axis=1)
    return np.einsum("tn,tni,tni->t", system.inverse_masses[system.tets[tets]], b, b)


def _sums(values: NDArray[np.float64], starts: NDArray[np.intp]) -> NDArray[np.float64]:
    if not len(values):
        return np.zeros(len(starts))
    ends = [*starts[1:], len(values)]
    return np.array([values[low:high].sum() for low, high in zip(starts, ends, strict=True)])


@njit
def _energies_of_block(points, tets, data, hard, out, low, high):
    for t in range(low, high):
        a, b, d, e = tets[t, 0], tets[t, 1], tets[t, 2], tets[t, 3]
        B = data[t]
        x, y, z = points[a, 0], points[a, 1], points[a, 2]
        ux, uy, uz = points[b, 0] - x, points[b, 1] - y, points[b, 2] - z
        vx, vy, vz = points[d, 0] - x, points[d, 1] - y, points[d, 2] - z
        qx, qy, qz = points[e, 0] - x, points[e, 1] - y, points[e, 2] - z
        f00, f01, f02 = (
            ux * B[0] + vx * B[3] + qx * B[6],
            ux * B[1] + vx * B[4] + qx * B[7],
            ux * B[2] + vx * B[5] + qx * B[8],
        )
        f10, f11, f12 = (
            uy * B[0] + vy * B[3] + qy * B[6],
            uy * B[1] + vy * B[4] + qy * B[7],
            uy * B[2] + vy * B[5] + qy * B[8],
        )
        f20, f21, f22 = (
            uz * B[0] + vz * B[3] + qz * B[6],
            uz * B[1] + vz * B[4] + qz * B[7],
            uz * B[2] + vz * B[5] + qz * B[8],
        )
        J = f00 * (f11 * f22 - f21 * f12) + f10 * (f21 * f02 - f01 * f22) + f20 * (f01 * f12 - f11 * f02)
        squares = f00 * f00 + f01 * f01 + f02 * f02 + f10 * f10 + f11 * f11 + f12 * f12
        squares += f20 * f20 + f21 * f21 + f22 * f22
        out[t] = B[9] * (0.5 * (squares - 3.0) - (J - 1.0)) + 0.5 * (B[10] + hard * B[11]) * (J - 1.0) * (J - 1.0)


@njit(cache=True, parallel=True, rows=0)
def _energies_of_tets(points, tets, data, hard, out):
    for block in prange((len(tets) + BLOCK - 1) // BLOCK):
        low = block * BLOCK
        _energies_of_block(points, tets, data, hard, out, low, min(low + BLOCK, len(tets)))


@njit(cache=True)
def _energies_of_edges(points, edges, springs, hard, out):
    for k in range(len(edges)):
        i, j = edges[k, 0], edges[k, 1]
        dx, dy, dz = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1], points[i, 2] - points[j, 2]
        longer = math.sqrt(dx * dx + dy * dy + dz * dz) - springs[k, 0]
        out[k] = 0.5 * (springs[k, 1] + hard * springs[k, 2]) * longer * longer
