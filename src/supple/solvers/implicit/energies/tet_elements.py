"""Tets with their rest shapes, and energies that three kernels give for each of them."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from supple.model.system import System
from supple.numerics.sparse.block_csr import incidences
from supple.runtime.kernel_cache import njit, prange
from supple.solvers.implicit.energies.potential import HessianBlocks, Potential, Projection


@dataclass(frozen=True, eq=False)
class TetElements:
    """Attributes
    ----------
    tets : (m, 4); rest_shape_inverse : (m, 3, 3) [1/m]; rest_volumes : (m,) [m^3]
    start, incidence : for every vertex the (tet, node) pairs that name it, coded 4 tet + node
    """

    tets: NDArray[np.int32]
    rest_shape_inverse: NDArray[np.float64]
    rest_volumes: NDArray[np.float64]
    start: NDArray[np.int32]
    incidence: NDArray[np.int32]

    @classmethod
    def of(cls, tets: NDArray[np.int32], B: NDArray[np.float64], volumes: NDArray[np.float64], n: int) -> TetElements:
        """Of tets with nodes among n vertices."""
        return cls(tets, B, volumes, *incidences(tets, n))

    @classmethod
    def of_system(cls, system: System) -> TetElements:
        return cls.of(system.tets, system.rest_shape_inverse, system.rest_volumes, len(system.rest_positions))

    def __len__(self) -> int:
        return len(self.tets)

    def gather(self, gradients: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        """Add every tet's gradient (m, 4, 3) to its nodes' rows of out (n, 3), in the order of the tets."""
        add_by_vertex(self.start, self.incidence, gradients.reshape(-1, 3), out)


class TetPotential(Potential):
    """The sum of an energy over tets.

    Attributes
    ----------
    kernels : of energies (m,), gradients (m, 4, 3), and matrices (m, 12, 12) that are added up. They take positions,
        tets, inverse rest shapes, `parameters`, for matrices whether to project, and where to write.
    """

    elements: TetElements
    kernels: ClassVar[tuple[Callable[..., None], Callable[..., None], Callable[..., None]]]
    label = "elasticity"
    projection = Projection.RELEASED_FIRST

    @property
    @abstractmethod
    def parameters(self) -> tuple[Any, ...]: ...

    def _arguments(self, x: NDArray[np.float64]) -> tuple[Any, ...]:
        return x, self.elements.tets, self.elements.rest_shape_inverse, *self.parameters

    def value(self, x: NDArray[np.float64]) -> float:
        return float(self.energies(x).sum())

    def energies(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(m,) of each tet [J]."""
        out = np.empty(len(self.elements))
        self.kernels[0](*self._arguments(x), out)
        return out

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        gradients = np.empty((len(self.elements), 4, 3))
        self.kernels[1](*self._arguments(x), gradients)
        self.elements.gather(gradients, out)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        self.kernels[2](*self._arguments(x), project, out.tets)


@njit(cache=True, parallel=True)
def add_by_vertex(start, entries, forces, out):
    """Add forces (m, 3) to the vertices' rows of out: those of vertex v are entries[start[v] : start[v + 1]]."""
    for v in prange(len(start) - 1):
        a, b, c = out[v, 0], out[v, 1], out[v, 2]
        for p in range(start[v], start[v + 1]):
            a += forces[entries[p], 0]
            b += forces[entries[p], 1]
            c += forces[entries[p], 2]
        out[v, 0], out[v, 1], out[v, 2] = a, b, c
