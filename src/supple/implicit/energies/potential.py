"""What an energy must answer to be part of the objective."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bsr_matrix


@dataclass(frozen=True, eq=False)
class HessianBlocks:
    """A sum of Hessians, not yet assembled.

    Attributes
    ----------
    elements : (m + k, 12, 12) one matrix for each tet, then one for each stitch, coordinate i of node p in row 3 p + i
        [N/m]
    vertices : (n, 3, 3) one matrix for each vertex with itself [N/m]
    tet_count : m
    couplings : (3 n, 3 n) matrices between vertices that no tet joins, in blocks of 3 x 3 [N/m]
    """

    elements: NDArray[np.float64]
    vertices: NDArray[np.float64]
    tet_count: int
    couplings: list[bsr_matrix] = field(default_factory=list)

    def clear(self) -> None:
        """Empty all but the tets' matrices, which elasticity overwrites."""
        self.vertices[:] = 0.0
        self.couplings.clear()

    @property
    def tets(self) -> NDArray[np.float64]:
        """(m, 12, 12) the tets' part of `elements`."""
        return self.elements[: self.tet_count]

    @property
    def stitches(self) -> NDArray[np.float64]:
        """(k, 12, 12) the stitches' part of `elements`."""
        return self.elements[self.tet_count :]

    @classmethod
    def zeros(cls, n_tets: int, n_vertices: int, n_stitches: int = 0) -> HessianBlocks:
        return cls(np.zeros((n_tets + n_stitches, 12, 12)), np.zeros((n_vertices, 3, 3)), n_tets)


class Potential(ABC):
    """An energy of the positions x (n, 3) of all vertices, pinned ones included.

    `label` says under which name the time that it takes is counted.
    """

    label = "other"

    @abstractmethod
    def value(self, x: NDArray[np.float64]) -> float:
        """The energy [J]; +inf where x is not allowed."""

    @abstractmethod
    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        """Add the gradient (n, 3) [N] to `out`."""

    @abstractmethod
    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        """Add the Hessian [N/m] to `out`; with `project`, that of a convex model of the energy at x."""

    def add_model(
        self, x: NDArray[np.float64], gradient: NDArray[np.float64], hessian: HessianBlocks | None, project: bool
    ) -> float:
        """The energy; its gradient and, where asked for, its Hessian added to what is given.

        The same as the three methods above, for potentials that save work by doing all at once.
        """
        self.add_gradient(x, gradient)
        if hessian is not None:
            self.add_hessian(x, hessian, project)
        return self.value(x)
