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
from supple.runtime.threads import threads_for
from supple.scene.stitches.stitching import Stitching
from supple.solvers.implicit.energies.elasticity import SERIAL_TETS, gather_gradients
from supple.solvers.implicit.energies.potential import HessianBlocks, Potential, Projection
from supple.solvers.implicit.energies.stitch_springs import spring_energies, spring_gradients, spring_hessians


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
        with threads_for(len(out), SERIAL_TETS):
            element_energies(points, *self._tets, out)
        return np.concatenate([out, spring_energies(self.stitching.springs, points)])

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        points, count = self._points(x), len(self.stitching.tets)
        gradients = np.empty((len(self.stitching), 4, 3))
        with threads_for(count, SERIAL_TETS):
            element_gradients(points, *self._tets, gradients[:count])
            spring_gradients(self.stitching.springs, points, gradients[count:])
            gather_gradients(*self.gathering, gradients, out)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        points, count = self._points(x), len(self.stitching.tets)
        blocks = np.empty((len(self.stitching), 12, 12))
        with threads_for(count, SERIAL_TETS):
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
