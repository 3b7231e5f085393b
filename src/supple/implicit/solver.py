"""`Implicit`: implicit time integration of finite elements that never invert."""

from __future__ import annotations

import logging
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from supple.errors import SolverError
from supple.implicit.contact.build import contact_model
from supple.implicit.contact.settings import IPCContact
from supple.implicit.contact.threads import one_contact_thread
from supple.implicit.energies.damping import viscosity_of
from supple.implicit.energies.elasticity import elasticity_of
from supple.implicit.energies.potential import HessianBlocks
from supple.implicit.energies.regularization import stabilizer_of
from supple.implicit.energies.stitch_damping import StitchViscosity
from supple.implicit.energies.stitches import StitchEnergy
from supple.implicit.limits.inversion_guard import refuse_inverted
from supple.implicit.newton.free_motion import FreeMotion
from supple.implicit.newton.linear_solver import LinearSolver
from supple.implicit.newton.minimize import Tools
from supple.implicit.newton.trace import NewtonRow
from supple.implicit.stepping.integrators import Integrator, Static, integrator_of
from supple.implicit.stepping.reactions import reaction_forces
from supple.implicit.stepping.substep import StepSettings, Substep, take_substep
from supple.implicit.stepping.substepping import Division
from supple.implicit.workspace import Workspace
from supple.solver import Solver
from supple.state import State, Status, StepReport
from supple.system import System

logger = logging.getLogger(__name__)

_DYNAMIC_TOLERANCE = 1e-3
_STATIC_TOLERANCE = 1e-9
_LINEAR_SOLVERS = ("auto", "pcg", "direct")


@dataclass(frozen=True)
class Implicit(Solver):
    """Implicit integration by projected Newton with a step filter: no tetrahedron that starts un-inverted ever inverts.

    Parameters
    ----------
    integrator : "backward_euler", "bdf2", "newmark" (midpoint), "static", or an `Integrator`.
    tolerance : Newton stops when no vertex's step is longer than this share of the (smallest) body's diagonal, per
        second of the step; for "static", than this share of the diagonal. None: 1e-3 1/s, or 1e-9.
    max_iterations : of Newton in one (sub)step.
    linear_solver : "pcg", "direct", or "auto": CG, and a factorization where CG stalls.
    max_substeps : a step that fails is halved until it would take more substeps than this. Steps in which scripts turn
        far are first divided into straight pieces (1024 at most), each of which may take so many. 1: never divided.
    contact : of bodies with each other, with themselves and with obstacles; None turns it off.

    Raises
    ------
    SolverError : where a parameter is out of range.

    Source: Li, Jiang, Luo, "Physics-Based Simulation", chapters 2 to 4 and 23.
    """

    integrator: str | Integrator = "backward_euler"
    tolerance: float | None = None
    max_iterations: int = 120
    linear_solver: str = "auto"
    max_substeps: int = 64
    contact: IPCContact | None = field(default_factory=IPCContact)

    def __post_init__(self) -> None:
        integrator_of(self.integrator)
        if self.tolerance is not None and not (
            isinstance(self.tolerance, (int, float)) and 0.0 < self.tolerance < np.inf
        ):
            raise SolverError(f"Implicit: tolerance is {self.tolerance!r}; give a finite number above zero")
        for key in ("max_iterations", "max_substeps"):
            value = getattr(self, key)
            if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 1:
                raise SolverError(f"Implicit: {key} is {value!r}; give a whole number of one or more")
        if self.linear_solver not in _LINEAR_SOLVERS:
            raise SolverError(
                f"Implicit: there is no linear_solver {self.linear_solver!r}; there are 'auto', 'pcg' and 'direct'"
            )

    def prepare(self, system: System) -> Workspace:
        """Patterns, groups and scratch memory for a system.

        Raises
        ------
        SolverError : for what this solver cannot work with: materials of XPBD, obstacles without contact,
            unheld bodies where static.
        """
        elasticity = elasticity_of(system)
        contact = None
        if self.contact is not None:
            contact = contact_model(system, self.contact, elasticity.material.mu)
            if contact.system is not system:
                system = contact.system
                elasticity = elasticity_of(system)
        elif system.obstacles:
            raise SolverError(
                f"{system.obstacles[0].label}: with contact=None obstacles do nothing; give contact=IPCContact(), or take "
                "them out"
            )
        method = integrator_of(self.integrator)
        free_motion = FreeMotion.of(system)
        if isinstance(method, Static) and len(free_motion.totals):
            body = next(part for part in system.bodies if free_motion.piece[part.vertices].max() >= 0)
            raise SolverError(
                f"body {body.name!r}: nothing holds it, so that it has no static equilibrium; pin some of its "
                "vertices, or use another integrator"
            )
        tools = Tools(
            LinearSolver.of(system, self.linear_solver),
            HessianBlocks.zeros(len(system.tets), len(system.rest_positions), len(system.stitching)),
            system.pinned_vertices,
            free_motion,
        )
        diagonal = min(
            float(np.linalg.norm(np.ptp(system.rest_positions[part.vertices], axis=0))) for part in system.bodies
        )
        stitches = StitchEnergy.of(system.stitching, 0.0) if len(system.stitching) else None
        viscosity = viscosity_of(elasticity)
        damped = StitchViscosity.of(system.stitching)
        return Workspace(
            system,
            contact,
            elasticity,
            viscosity,
            tools,
            diagonal,
            stabilizer_of(elasticity),
            stitches,
            damped,
        )

    @one_contact_thread()
    def step(self, system: System, state: State, dt: float, workspace: Workspace) -> tuple[State, StepReport]:
        """Advance by dt, in as many substeps as it takes; see `Solver.step`.

        Raises
        ------
        SolverError : where the state has inverted tets of a material that has no energy there.
        """
        refuse_inverted(system, workspace.elasticity.material, state.positions)
        n = len(state.positions)
        state = workspace.taken_in(state)
        workspace.tools.clock.restart()
        division = Division.of(workspace.system, state.time, dt, workspace.diagonal, self.max_substeps)
        now = state
        settings = StepSettings(integrator_of(self.integrator), self.tolerance, self.max_iterations)
        rows: list[NewtonRow] = []
        substeps = 0
        worst, message = Status.CONVERGED, ""
        last: Substep | None = None
        while not division.over:
            taken = take_substep(now, division.end, division.length, settings, workspace)
            rows += [replace(row, substep=substeps) for row in taken.outcome.rows]
            if taken.outcome.status is not Status.CONVERGED:
                logger.debug("step of %g s: %s", division.length, taken.outcome.status)
                if division.halve():
                    continue
                worst, message = taken.outcome.status, _limit_message(taken.outcome.message, division)
                if not worst.can_go_on:
                    break
            now, last = taken.state, taken
            substeps += 1
            division.advance()
        now = replace(now, positions=now.positions[:n], velocities=now.velocities[:n])
        workspace.last = now.positions
        details = _details(rows, substeps)
        report = StepReport(worst, sum(row.kind == "newton" for row in rows), message, details=details)
        if last is not None:
            gradient = last.outcome.end.gradient / last.contact.weight
            details["reaction_forces"], details["reaction_forces_by_vertex"] = reaction_forces(system, gradient)
            report = last.contact.completed(report, last.state.positions)
        report.details["seconds"] = workspace.tools.clock.shares()
        return now, report


def _limit_message(said: str, division: Division) -> str:
    """Why a substep failed that may not be divided any more."""
    if division.halves == 1:
        return said
    return f"{said}; in a substep of {division.length:.3g} s, which max_substeps lets be no shorter"


def _details(rows: list[NewtonRow], substeps: int) -> dict[str, Any]:
    return {
        "newton_iterations": sum(row.kind == "newton" for row in rows),
        "extension_iterations": sum(row.kind == "extension" for row in rows),
        "cg_iterations": sum(row.linear_iterations for row in rows),
        "direct_solves": sum(row.linear_solver == "direct" for row in rows),
        "line_search_cuts": sum(row.cuts for row in rows),
        "filter_steps": sum(row.filter < 1.0 for row in rows),
        "substeps": substeps,
        "newton": rows,
    }
