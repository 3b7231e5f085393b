"""Drag of a flow as a potential of a step: sum c_i |v_i - w|^2 / (2 r), with the velocities v = r (x - x^).

Its gradient is c (v - w), minus the force, and its Hessian the diagonal c r. The coefficients c are those where the
step begins.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.model.loads.applied import DragLoad
from supple.model.state import State
from supple.model.system import System
from supple.solvers.implicit.energies.potential import HessianBlocks, Potential, Projection


@dataclass(frozen=True, eq=False)
class DragPotential(Potential):
    """One load in one step.

    Parameters
    ----------
    coefficients : (n,) c [kg/s]; flow : (3,) w [m/s]
    start : (n, 3) x_n, where the step begins [m]; velocity : (n, 3) v there [m/s]; rate : r [1/s]; zero in equilibrium,
        where the potential is -c w . (x - x_n)
    """

    coefficients: NDArray[np.float64]
    flow: NDArray[np.float64]
    start: NDArray[np.float64]
    velocity: NDArray[np.float64]
    rate: float
    work = "wind"
    projection = Projection.UNNEEDED

    def value(self, x: NDArray[np.float64]) -> float:
        d = x - self.start
        return float(np.einsum("i,ij,ij->", self.coefficients, self.velocity - self.flow + 0.5 * self.rate * d, d))

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        out += self.coefficients[:, None] * (self.velocity - self.flow + self.rate * (x - self.start))

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        out.vertices += (self.rate * self.coefficients)[:, None, None] * np.eye(3)


def drags_at(system: System, state: State, begun: NDArray[np.float64], rate: float, time: float) -> list[DragPotential]:
    """The drags of a step from a state, with flows at `time` [s].

    Parameters
    ----------
    begun : (n, 3) velocities that positions x_n mean where forces act [m/s]; rate : r, zero in equilibrium [1/s]
    """
    x, v = state.positions, state.velocities if rate else np.zeros_like(state.velocities)
    loads = (load for load in system.loads if isinstance(load, DragLoad))
    return [DragPotential(load.coefficients(x, v, time), load.value(time), x, begun, rate) for load in loads]
