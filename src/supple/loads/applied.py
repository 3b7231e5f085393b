"""Loads on the vertices of a system."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic_tets.active import ActiveTets
from supple.scene.loads.body_force import BodyForce


class AppliedLoad(ABC):
    """A load, with the numbers of the vertices that it acts on.

    Attributes
    ----------
    is_internal : whether its forces act between vertices of one body, so that they change no momentum
    work : the name under which its work is counted, see `Report.work`
    """

    is_internal: ClassVar[bool] = False
    work: str

    @abstractmethod
    def renumbered(self, new: NDArray[np.int32]) -> Self:
        """The same load where vertex i has the number new[i]."""

    @abstractmethod
    def acts_on(self) -> NDArray[np.int32]:
        """The vertices that the load acts on."""

    @abstractmethod
    def add_forces(self, x: NDArray[np.float64], time: float, out: NDArray[np.float64]) -> None:
        """Add the forces on the vertices at x (n, 3) [m] and `time` [s] to `out` (n, 3) [N]."""


@dataclass(frozen=True, eq=False)
class DeadLoad(AppliedLoad):
    """Forces that do not depend on where the vertices are; `per_vertex` : time -> (k, 3) [N] on `vertices` (k,)."""

    vertices: NDArray[np.int32]
    per_vertex: Callable[[float], NDArray[np.float64]]
    work: str

    def renumbered(self, new: NDArray[np.int32]) -> DeadLoad:
        return replace(self, vertices=new[self.vertices])

    def acts_on(self) -> NDArray[np.int32]:
        return self.vertices

    def add_forces(self, x: NDArray[np.float64], time: float, out: NDArray[np.float64]) -> None:
        out[self.vertices] += self.per_vertex(time)


@dataclass(frozen=True, eq=False)
class MassLoad(AppliedLoad):
    """Forces per mass on `vertices` (k,) with `masses` (k,) [kg]."""

    load: BodyForce
    vertices: NDArray[np.int32]
    masses: NDArray[np.float64]

    work = "body_forces"

    def renumbered(self, new: NDArray[np.int32]) -> MassLoad:
        return replace(self, vertices=new[self.vertices])

    def acts_on(self) -> NDArray[np.int32]:
        return self.vertices

    def add_forces(self, x: NDArray[np.float64], time: float, out: NDArray[np.float64]) -> None:
        out[self.vertices] += self.masses[:, None] * self.load.at(x[self.vertices], time)


class ActiveLoad(AppliedLoad):
    """A load of tets that act by themselves."""

    is_internal = True

    @abstractmethod
    def active(self, time: float) -> ActiveTets:
        """What it is at `time` [s]."""
