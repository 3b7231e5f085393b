"""Energy of stitches: tetrahedra of stable Neo-Hookean material, and springs.

Stitch tets may start flat, so that no filter prevents their inversion. Corners on obstacles are not unknowns; they move
with the obstacle.

Source: "Soft Vertex Triangle Stitch", the documentation of libuipc's constitution #30; the constant of its energy
density is left out, so that the energy is zero at rest.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic import StableNeoHookean
from supple.materials.tet_energies import element_energies, element_gradients, element_hessians
from supple.numerics.sparse.block_csr import incidences
from supple.scene.stitches.elements import Springs
from supple.scene.stitches.stitching import Stitching
from supple.solvers.implicit.energies.potential import HessianBlocks, Potential, Projection
from supple.solvers.implicit.energies.tet_elements import add_by_vertex

# Energy, gradient and Hessian of springs between vertices and points of edges: k/2 (|d| - l)^2.
#
# With d = sum_p c_p x_p, c = (1, t - 1, -t), the block of nodes p and q is c_p c_q K with
#
# K = k n n^T + k (1 - l / |d|) (I - n n^T),    n = d / |d|.
#
# Projection omits the second term where it is negative: where the spring is shorter than at rest.


def spring_energies(springs: Springs, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k,) [J] at positions `points` (n, 3) [m]."""
    lengths = np.linalg.norm(springs.extensions(points), axis=1)
    return 0.5 * springs.stiffness * (lengths - springs.rest_lengths) ** 2


def spring_gradients(springs: Springs, points: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    """By the nodes [N], into out (k, 4, 3); the fourth is not a node. A spring of zero length has no force."""
    d = springs.extensions(points)
    lengths = np.linalg.norm(d, axis=1)
    share = springs.rest_lengths / np.where(lengths > 0.0, lengths, np.inf)
    force = (springs.stiffness * (1.0 - share))[:, None] * d
    out[:] = _coefficients(springs)[:, :, None] * force[:, None, :]


def spring_hessians(springs: Springs, points: NDArray[np.float64], project: bool, out: NDArray[np.float64]) -> None:
    """By the nodes [N/m], into out (k, 12, 12); with `project`, of a convex model."""
    d = springs.extensions(points)
    lengths = np.linalg.norm(d, axis=1)
    n = d / np.where(lengths > 0.0, lengths, 1.0)[:, None]
    c, K = _coefficients(springs), spring_matrices(springs.stiffness, springs.rest_lengths, lengths, n, project)
    out[:] = np.einsum("kp,kq,kij->kpiqj", c, c, K).reshape(-1, 12, 12)


def spring_matrices(
    stiffness: NDArray[np.float64],
    rest_lengths: NDArray[np.float64],
    lengths: NDArray[np.float64],
    n: NDArray[np.float64],
    project: bool,
) -> NDArray[np.float64]:
    """K (k, 3, 3) of springs with unit vectors n (k, 3); see above."""
    aside = 1.0 - rest_lengths / np.where(lengths > 0.0, lengths, np.inf)
    if project:
        aside = np.maximum(aside, 0.0)
    both = np.einsum("ki,kj->kij", n, n)
    return stiffness[:, None, None] * (both + aside[:, None, None] * (np.eye(3) - both))


def _coefficients(springs: Springs) -> NDArray[np.float64]:
    """(k, 4) of each node in d. Where both ends of the edge are one vertex, the first has the whole coefficient."""
    c = np.zeros((len(springs), 4))
    alone = springs.vertices[:, 1] == springs.vertices[:, 2]
    c[:, 0] = 1.0
    c[:, 1] = np.where(alone, -1.0, springs.place - 1.0)
    c[:, 2] = np.where(alone, 0.0, -springs.place)
    return c


@dataclass(frozen=True, eq=False)
class StitchEnergy(Potential):
    """The energy of all stitches, with the anchors (a, 3) where they are at one time [m]."""

    stitching: Stitching
    anchors: NDArray[np.float64]
    gathering: tuple[NDArray[np.int32], NDArray[np.int32]] = field(repr=False)
    projection = Projection.RELEASED_FIRST

    @classmethod
    def of(cls, stitching: Stitching, time: float) -> StitchEnergy:
        """The energy at `time` [s]."""
        gathering = incidences(stitching.elements(), stitching.body_vertices)
        return cls(stitching, stitching.anchors.at(time), gathering)

    def at(self, time: float) -> StitchEnergy:
        """The same at another time [s]."""
        return StitchEnergy(self.stitching, self.stitching.anchors.at(time), self.gathering)

    def value(self, x: NDArray[np.float64]) -> float:
        return float(self.energies(x).sum())

    def energies(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(k,) of each stitch, tets first [J]."""
        points = self._points(x)
        out = np.empty(len(self.stitching.tets))
        element_energies(points, *self._tets, out)
        return np.concatenate([out, spring_energies(self.stitching.springs, points)])

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        points, count = self._points(x), len(self.stitching.tets)
        gradients = np.empty((len(self.stitching), 4, 3))
        element_gradients(points, *self._tets, gradients[:count])
        spring_gradients(self.stitching.springs, points, gradients[count:])
        add_by_vertex(*self.gathering, gradients.reshape(-1, 3), out)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        points, count = self._points(x), len(self.stitching.tets)
        blocks = np.empty((len(self.stitching), 12, 12))
        element_hessians(points, *self._tets, project, blocks[:count])
        spring_hessians(self.stitching.springs, points, project, blocks[count:])
        out.stitches[:] += blocks

    def _points(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.concatenate([x[: self.stitching.body_vertices], self.anchors]) if len(self.anchors) else x

    @cached_property
    def _tets(self) -> tuple[NDArray, NDArray, NDArray, NDArray, NDArray, NDArray]:
        tets = self.stitching.tets
        kind = np.full(len(tets), StableNeoHookean.energy_kind(), dtype=np.int32)
        return tets.vertices, tets.rest_shape_inverse, tets.rest_volumes, kind, tets.mu, tets.lam
