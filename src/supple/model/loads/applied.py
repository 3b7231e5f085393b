"""Loads on the vertices of a system."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic_tets.active import ActiveTets
from supple.scene.body import PlacedBody
from supple.scene.inputs import is_steady
from supple.scene.loads.body_force import BodyForce


@dataclass(frozen=True, eq=False)
class Setting:
    """The bodies of a scene where a simulation begins.

    Attributes
    ----------
    begins : by body name, the number of its first vertex; masses : (n,) of all vertices [kg]
    x : (n, 3) where the simulation begins [m]
    """

    bodies: Sequence[PlacedBody]
    begins: dict[str, int]
    masses: NDArray[np.float64]
    x: NDArray[np.float64]

    def body(self, name: str) -> PlacedBody:
        """The body of that name."""
        return next(body for body in self.bodies if body.name == name)

    def first_tet(self, name: str) -> int:
        """The number of a body's first tet among those of all bodies."""
        return sum(len(body.mesh.tets) for body in self.bodies[: [body.name for body in self.bodies].index(name)])


class AppliedLoad(ABC):
    """A load, with the numbers of the vertices that it acts on.

    Attributes
    ----------
    is_internal : whether its forces act between vertices of one body, or have no sum and no moment there, so that they
        change no momentum
    is_steady : whether its forces stay the same within a frame, wherever the vertices are
    work : the name under which its work is counted, see `Report.work`
    """

    is_internal: bool = False
    is_steady: bool = False
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
    is_steady: bool = False

    @classmethod
    def shared(
        cls,
        vertices: NDArray[np.int32],
        weights: NDArray[np.float64],
        vector: Callable[[float], NDArray[np.float64]],
        work: str,
        is_steady: bool = False,
    ) -> DeadLoad:
        """One vector times the weight of each vertex; `vector` : time -> (3,)."""
        return cls(vertices, lambda time: weights[:, None] * vector(time), work, is_steady)

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

    @property
    def is_steady(self) -> bool:
        return is_steady(self.load.force)

    def renumbered(self, new: NDArray[np.int32]) -> MassLoad:
        return replace(self, vertices=new[self.vertices])

    def acts_on(self) -> NDArray[np.int32]:
        return self.vertices

    def add_forces(self, x: NDArray[np.float64], time: float, out: NDArray[np.float64]) -> None:
        out[self.vertices] += self.masses[:, None] * self.load.at(x[self.vertices], time)


class DragLoad(AppliedLoad):
    """Forces c_i (w - v_i) on vertices with the velocities v_i in a flow of velocity w.

    `value` is w (3,) [m/s]. The forces are internal to no body, and damp the motion against the flow.
    """

    @abstractmethod
    def value(self, time: float) -> NDArray[np.float64]:
        """w (3,) [m/s]"""

    @abstractmethod
    def coefficients(self, x: NDArray[np.float64], v: NDArray[np.float64], time: float) -> NDArray[np.float64]:
        """(n,) c [kg/s], not below zero, at positions x and velocities v (n, 3) of all vertices."""

    def add_forces(self, x: NDArray[np.float64], time: float, out: NDArray[np.float64]) -> None:
        """Those on vertices at rest."""
        at_rest = np.zeros_like(x)
        out += self.coefficients(x, at_rest, time)[:, None] * self.value(time)


class ActiveLoad(AppliedLoad):
    """A load of tets that act by themselves."""

    is_internal = True

    @abstractmethod
    def active(self, time: float) -> ActiveTets:
        """What it is at `time` [s]."""
