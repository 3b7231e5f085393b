"""Actuators: one number that positions determine, and the generalized force that acts on it.

A cavity has its volume V and its pressure p, a cable its length and its tension. The force on vertex i is Q ds/dx_i.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from supple.loads.actuators.laws import Law
from supple.numerics.sparse.couplings import Couplings


class Coordinate(ABC):
    """A number s that the positions of some vertices determine.

    Attributes
    ----------
    vertices : (v,) all different; the methods take the positions (v, 3) of these [m]
    """

    vertices: NDArray[np.int32]

    @abstractmethod
    def renumbered(self, new: NDArray[np.int32]) -> Self:
        """The same where vertex i has the number new[i]."""

    @abstractmethod
    def value(self, own: NDArray[np.float64]) -> float:
        """s"""

    @abstractmethod
    def gradient(self, own: NDArray[np.float64]) -> NDArray[np.float64]:
        """(v, 3) of s"""

    @abstractmethod
    def hessian(self, own: NDArray[np.float64], factor: float, project: bool) -> Couplings | None:
        """`factor` times the second derivative of s; with `project`, the part known to be positive semi-definite."""


@dataclass(frozen=True, eq=False)
class Actuator:
    """One actuator of a system.

    Attributes
    ----------
    kind : "cavity"; name : of it in the scene
    coordinate : s; start : s where the simulation began; law : of the generalized force Q, positive where it increases
        s, so that Q ds is the work on the bodies
    """

    kind: str
    name: str
    coordinate: Coordinate
    start: float
    law: Law

    def value(self, x: NDArray[np.float64]) -> float:
        """s at the positions x (n, 3) of all vertices [m]."""
        return self.coordinate.value(x[self.coordinate.vertices])

    def renumbered(self, new: NDArray[np.int32]) -> Actuator:
        """The same actuator where vertex i has the number new[i]."""
        return replace(self, coordinate=self.coordinate.renumbered(new))
