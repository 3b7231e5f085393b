"""What a frame takes on one core, by counts: for choices that keep a page as fast as real time."""

from __future__ import annotations

from dataclasses import replace

from supple.model.system import System
from supple.solvers.auto import cost_of_frame
from supple.solvers.solver import Solver
from supple.solvers.xpbd.solver import XPBD

# Of the time of a frame, what the solver may take by counts, and for each body [ms]: pulls and blows cost up to twice
# as much as a frame in which nothing happens.
_SHARE, _BODY = 0.5, 0.5
_TET_IN_PILE = 3e-7  # a substep for each tet of many bodies that touch each other [s]


def slowness(system: System, solver: Solver, dt: float) -> float:
    """The cost of a frame of `dt` [s] as a share of what keeps up with real time."""
    allowed = max(1e3 * _SHARE * dt - _BODY * len(system.bodies), 1e2 * dt)
    return cost_of_frame(solver, system, dt) / allowed


def without_long_repetitions(solver: Solver, system: System, dt: float, usual: int) -> Solver:
    """XPBD that simulates a frame with at most twice the usual number of substeps, or what fits into a frame.

    A body that is pressed against itself may need sixteen times as many: each frame then takes half a second, and
    differs little. Its status names the remaining error. Scenes with rigid bodies sometimes need more.
    """
    if not isinstance(solver, XPBD) or solver.substeps != "auto" or any(part.rigid for part in system.bodies):
        return solver
    most = max(2 * usual, int(dt / (_TET_IN_PILE * max(1, len(system.tets)))))
    return replace(solver, max_substeps=most) if most < solver.max_substeps else solver
