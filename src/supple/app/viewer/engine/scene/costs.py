"""What a frame takes on one core: for choices that keep a page as fast as real time."""

from __future__ import annotations

from dataclasses import replace

from supple.model.system import System
from supple.solvers.solver import Solver
from supple.solvers.xpbd.solver import XPBD

# At all and for each body, and in each substep for each tet, of one body and of many that touch each other [s].
# Measured on an AMD EPYC; see notes/measured_trials.md.
_FRAME, _BODY, _TET_ALONE, _TET_IN_PILE = 1e-3, 5e-4, 1.3e-7, 3e-7
_SHARE = 0.9  # of the time of a frame that the solver may take


def taken(system: System, substeps: int, measured: float) -> float:
    """The time of a frame without what each body costs [s]: as measured, or what substeps will take in a pile."""
    each = substeps * len(system.tets) * (_TET_ALONE if len(system.bodies) == 1 else _TET_IN_PILE)
    return max(each, measured - _fixed(system))


def allowed(system: System, dt: float) -> float:
    """The time, without what each body costs, that a frame of `dt` [s] may take [s]."""
    return max(_SHARE * dt - _fixed(system), 0.1 * dt)


def _fixed(system: System) -> float:
    return _FRAME + _BODY * len(system.bodies)


def without_long_repetitions(solver: Solver, system: System, dt: float, usual: int) -> Solver:
    """XPBD that simulates a frame with at most twice the usual number of substeps, or what fits into a frame.

    A body that is pressed against itself may need sixteen times as many: each frame then takes half a second, and
    differs little. Its status names the remaining error. Scenes with rigid bodies sometimes need more.
    """
    if not isinstance(solver, XPBD) or solver.substeps != "auto" or any(part.rigid for part in system.bodies):
        return solver
    most = max(2 * usual, int(dt / (_TET_IN_PILE * max(1, len(system.tets)))))
    return replace(solver, max_substeps=most) if most < solver.max_substeps else solver
