"""Actuators: one number that positions determine, and the generalized force that acts on it.

A cavity has its volume V and its pressure p, a cable its length and its tension. The force on vertex i is Q ds/dx_i.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from supple.model.loads.actuators.laws import Law
from supple.numerics.sparse.couplings import Couplings


class Coordinate(ABC):
    """A number s that the positions of some vertices determine, the sum of one or more parts.

    Attributes
    ----------
    vertices : (v,) all different; the methods take the positions (v, 3) of these [m]
    """

    vertices: NDArray[np.int32]

    @property
    def is_anchored(self) -> bool:
        """Whether s depends on places that are fixed in the world."""
        return False

    @abstractmethod
    def renumbered(self, new: NDArray[np.int32]) -> Self:
        """The same where vertex i has the number new[i]."""

    @property
    @abstractmethod
    def count(self) -> int:
        """p, the number of parts."""

    @abstractmethod
    def measure(self, own: NDArray[np.float64], parts: NDArray[np.float64]) -> None:
        """Set the parts (p,)."""

    @abstractmethod
    def differentiate(
        self, own: NDArray[np.float64], parts: NDArray[np.float64], gradients: NDArray[np.float64]
    ) -> None:
        """Set the parts (p,) and their gradients (p, v, 3)."""

    @abstractmethod
    def hessian(self, own: NDArray[np.float64], factors: NDArray[np.float64], project: bool) -> Couplings | None:
        """The sum of `factors` (p,) times the second derivatives of the parts.

        With `project`, the part of it that is known to be positive semi-definite.
        """

    def parts(self, own: NDArray[np.float64]) -> NDArray[np.float64]:
        """(p,)"""
        parts = np.empty(self.count)
        self.measure(own, parts)
        return parts

    def part_gradients(self, own: NDArray[np.float64]) -> NDArray[np.float64]:
        """(p, v, 3)"""
        gradients = np.empty((self.count, *own.shape))
        self.differentiate(own, np.empty(self.count), gradients)
        return gradients

    def value(self, own: NDArray[np.float64]) -> float:
        """s"""
        return float(self.parts(own).sum())

    def gradient(self, own: NDArray[np.float64]) -> NDArray[np.float64]:
        """(v, 3) of s"""
        return self.part_gradients(own).sum(axis=0)


@dataclass(frozen=True, eq=False)
class Actuator:
    """One actuator of a system.

    Attributes
    ----------
    kind : "cavity" or "cable"; name : of it in the scene
    coordinate : s; start : s where the simulation began; law : of the generalized force Q, positive where it increases
        s, so that Q ds is the work on the bodies
    friction : at the eyelets of a cable
    """

    kind: str
    name: str
    coordinate: Coordinate
    start: float
    law: Law
    friction: float = 0.0

    @property
    def work(self) -> str:
        """The name under which its work is counted, see `Report.work`."""
        return {"cavity": "cavities", "cable": "cables"}[self.kind]

    def parts(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(p,) of s at the positions x (n, 3) of all vertices [m]."""
        return self.coordinate.parts(x[self.coordinate.vertices])

    def renumbered(self, new: NDArray[np.int32]) -> Actuator:
        """The same actuator where vertex i has the number new[i]."""
        return replace(self, coordinate=self.coordinate.renumbered(new))
