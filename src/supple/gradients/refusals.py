"""What is not differentiated, as errors before the run."""

from __future__ import annotations

from supple.errors import SolverError
from supple.model.loads.applied import DragLoad
from supple.model.system import System
from supple.solvers.implicit.solver import Implicit
from supple.solvers.implicit.stepping.integrators import BDF2, BackwardEuler, Static, integrator_of


def refuse(system: System, solver: Implicit) -> None:
    """Raise `SolverError` for a scene or solver whose gradient would not be that of its run."""
    method = integrator_of(solver.integrator)
    if not isinstance(method, BackwardEuler | BDF2 | Static):
        raise SolverError(
            f"gradient: integrator {method.name!r} is not differentiated; use 'backward_euler', 'bdf2' or 'static'"
        )
    if solver.max_iterations <= 3:
        raise SolverError(
            "gradient: linearizations do not end where forces are balanced; give Implicit more max_iterations"
        )
    if any(tets.points > 1 for tets, _ in system.laws.material.flowing_laws):
        raise SolverError("gradient: materials that flow are not differentiated in quadratic tets; use linear ones")
    if system.shells is not None or system.rods is not None:
        raise SolverError("gradient: shells and rods are not differentiated; fit them with a method without gradients")
    for actuator in system.actuators:
        if actuator.friction > 0.0:
            raise SolverError("gradient: cables with friction in their eyelets are not differentiated")
    for load in system.loads:
        if isinstance(load, DragLoad):
            raise SolverError("gradient: wind and drag are not differentiated")
