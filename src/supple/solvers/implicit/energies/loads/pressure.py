"""Pressure that follows a surface, as a potential: p W, with the volume W that the surface sweeps in the step.

Of a closed surface W is the change of its volume, so that the forces are exact everywhere and derive from a potential.
Of a part of a surface they have none. The gradient of p W is then the exact force where the step begins, and follows
the surface within the step up to an error of first order in its length.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.model.loads.applied import DragLoad
from supple.model.loads.pressure import FollowerPressure, SweptTriangles
from supple.model.state import State
from supple.model.system import System
from supple.numerics.sparse.couplings import Couplings
from supple.solvers.implicit.energies.potential import HessianBlocks, Potential, Projection
from supple.solvers.implicit.energies.vertex_potential import VertexPotential


def drags_at(
    system: System, state: State, begun: NDArray[np.float64], rate: float, time: float
) -> list[VertexPotential]:
    """The drags of a step from a state, with flows at `time` [s]: sum c_i |v_i - w|^2 / (2 r), less a constant.

    The velocities are v = r (x - x^). The gradient is c (v - w), minus the force. The coefficients c are those where
    the step begins.

    Parameters
    ----------
    begun : (n, 3) velocities that positions x_n mean where forces act [m/s]; rate : r, zero in equilibrium [1/s]
    """
    x, v = state.positions, state.velocities if rate else np.zeros_like(state.velocities)
    found = []
    for load in system.loads:
        if isinstance(load, DragLoad):
            c = load.coefficients(x, v, time)
            found.append(
                VertexPotential(
                    x, np.repeat(rate * c[:, None], 3, axis=1), c[:, None] * (load.value(time) - begun), "wind"
                )
            )
    return found


@dataclass(frozen=True, eq=False)
class PressurePotential(Potential):
    """One pressure in one step.

    Parameters
    ----------
    triangles : (t, 3); pressure : p [Pa]; start : (n, 3) where the step begins [m]
    """

    triangles: NDArray[np.int32]
    pressure: float
    start: NDArray[np.float64]
    projection = Projection.RELEASED_FIRST
    work = "pressures"

    def value(self, x: NDArray[np.float64]) -> float:
        return self.pressure * self._swept(x).volume()

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        self._swept(x).add_gradient(self.pressure, out)

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        """With `project`, zero: the linear model. The true one has no diagonal, so that it is never definite."""
        if not project:
            rows, columns, blocks = self._swept(x).hessian()
            out.loads.append(Couplings(rows, columns, self.pressure * blocks))

    def _swept(self, x: NDArray[np.float64]) -> SweptTriangles:
        return SweptTriangles(self.start, x, self.triangles)


def pressures_at(system: System, x: NDArray[np.float64], time: float) -> list[PressurePotential]:
    """The pressures at `time` [s] of a step that begins at x (n, 3)."""
    loads = (load for load in system.loads if isinstance(load, FollowerPressure))
    return [PressurePotential(load.triangles, load.pressure(time), x) for load in loads]
