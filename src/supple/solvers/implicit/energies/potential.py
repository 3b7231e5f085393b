"""What an energy must provide to be a term of the objective."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from supple.numerics.sparse.couplings import Correction, Couplings, RankOne


class Projection(Enum):
    """When a term's Hessian is projected to be positive semi-definite; every term declares it."""

    UNNEEDED = 0  # it is positive semi-definite everywhere
    RELEASED_FIRST = 1  # projected while Newton's method is far from the minimum
    RELEASED_LAST = 2  # projected until all other terms' true Hessians have not been enough


@dataclass(eq=False)
class HessianBlocks:
    """A sum of Hessians, not yet assembled.

    Attributes
    ----------
    memory : (m + k, 12, 12) of `elements`
    vertices : (n, 3, 3) one matrix for each vertex with itself [N/m]
    tet_count : m
    couplings : matrices of contacts and joints, between vertices that no element joins [N/m]
    patches, loads : matrices of patches of tets and of quadratic tets, and of loads, likewise [N/m]
    low_rank : matrices between all vertices of an actuator [N/m]
    corrections : what the sum of all others exceeds the Hessian by, where no sparse matrix could hold that
    blank : whether nothing has been added to `elements`; the memory may then hold an earlier sum
    """

    memory: NDArray[np.float64]
    vertices: NDArray[np.float64]
    tet_count: int
    couplings: list[Couplings] = field(default_factory=list)
    patches: list[Couplings] = field(default_factory=list)
    loads: list[Couplings] = field(default_factory=list)
    low_rank: list[RankOne] = field(default_factory=list)
    corrections: list[Correction] = field(default_factory=list)
    blank: bool = False

    def clear(self) -> None:
        """Start a new sum."""
        self.vertices[:] = 0.0
        self.couplings.clear()
        self.patches.clear()
        self.loads.clear()
        self.low_rank.clear()
        self.corrections.clear()
        self.blank = True

    @property
    def beyond_elements(self) -> list[Couplings]:
        """The matrices of patches, quadratic tets and loads, then those of contacts and joints."""
        return [*self.patches, *self.loads, *self.couplings]

    @property
    def between_bodies(self) -> list[Couplings]:
        """The matrices of loads, then those of contacts and joints."""
        return [*self.loads, *self.couplings]

    @property
    def elements(self) -> NDArray[np.float64]:
        """(m + k, 12, 12) one matrix for each tet, then one for each stitch, to which terms add [N/m].

        Coordinate i of node p is row 3 p + i.
        """
        if self.blank:
            self.memory[:] = 0.0
            self.blank = False
        return self.memory

    @property
    def tets(self) -> NDArray[np.float64]:
        """(m, 12, 12) the tets' part of `elements`."""
        return self.elements[: self.tet_count]

    @property
    def stitches(self) -> NDArray[np.float64]:
        """(k, 12, 12) the stitches' part of `elements`."""
        return self.elements[self.tet_count :]

    def add_tets(self, write: Callable[[NDArray[np.float64]], None]) -> None:
        """Add the matrices (m, 12, 12) that `write` fills in completely; the first ones need no cleared memory."""
        tets = self.memory[: self.tet_count]
        if self.blank:
            self.memory[self.tet_count :] = 0.0
            self.blank = False
            write(tets)
        else:
            more = np.empty_like(tets)
            write(more)
            tets += more

    @classmethod
    def zeros(cls, n_tets: int, n_vertices: int, n_stitches: int = 0) -> HessianBlocks:
        return cls(np.zeros((n_tets + n_stitches, 12, 12)), np.zeros((n_vertices, 3, 3)), n_tets, blank=True)


class Potential(ABC):
    """An energy of the positions x (n, 3) of all vertices, pinned ones included.

    Attributes
    ----------
    label : the name under which the time that it takes is counted
    projection : when its Hessian is projected
    work : the name under which the work of its forces is counted, see `Report.work`; None for energies that bodies
        store, for actuators, whose work is that of their generalized forces, and for numerical aids
    """

    label: str = "other"
    projection: Projection
    work: str | None = None

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
        """The energy; its gradient and, where it is given, its Hessian are added to the arguments.

        The same as the three methods above, for potentials that save work by doing all at once.
        """
        self.add_gradient(x, gradient)
        if hessian is not None:
            self.add_hessian(x, hessian, project)
        return self.value(x)

    def renew(self, x: NDArray[np.float64], direction: NDArray[np.float64]) -> None:
        """Set the unknowns that this term has of its own, its duals, to those at the end of a whole step.

        The step is from x (n, 3), whose Hessian gave `direction` (n, 3). Most terms have none. An objective with a term
        that has some serves one minimization.
        """
        return


class JointlyEvaluated(Potential):
    """A potential whose gradient and Hessian come from `add_model`."""

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        self.add_model(x, out, None, project=False)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        self.add_model(x, np.zeros_like(x), out, project)

    @abstractmethod
    def add_model(
        self, x: NDArray[np.float64], gradient: NDArray[np.float64], hessian: HessianBlocks | None, project: bool
    ) -> float: ...


class Wrapped(Potential):
    """A potential made of an inner one, with the label, work and projection of that."""

    inner: Potential

    @property
    def label(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.inner.label

    @property
    def work(self) -> str | None:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.inner.work

    @property
    def projection(self) -> Projection:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.inner.projection


class ContactPotential(Potential):
    """A term of contact or of joints: so stiff that a short Newton step can leave large forces."""

    label = "contact"
    work = "contact"
    projection = Projection.RELEASED_LAST
