"""`Implicit`: implicit time integration of finite elements that never invert."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import SolverError
from supple.implicit.damping import Damping, StrainRate, Viscosity, green_strain_rates, green_strains, viscosity_of
from supple.implicit.elasticity import Elasticity, elasticity_of
from supple.implicit.external_forces import ExternalForces, total_forces
from supple.implicit.free_motion import FreeMotion
from supple.implicit.gravity import Gravity
from supple.implicit.guard import Guard, refuse_inverted
from supple.implicit.inertia import Inertia
from supple.implicit.integrators import Integrator, Plan, Static, integrator_of
from supple.implicit.inversion_barrier import inversion_barrier
from supple.implicit.linear_solver import LinearSolver
from supple.implicit.newton import Outcome, Problem, Tools, minimize
from supple.implicit.objective import Objective
from supple.implicit.pin_motion import move_pins
from supple.implicit.potential import HessianBlocks, Potential
from supple.implicit.reactions import reaction_forces
from supple.implicit.soft_targets import soft_targets_at
from supple.implicit.stabilizer import Stabilizer, stabilizer_of
from supple.implicit.stitch_energy import StitchEnergy
from supple.implicit.trace import NewtonRow
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
    integrator : "backward_euler", "bdf2", "newmark" (trapezoidal), "static", or an `Integrator`.
    tolerance : Newton stops when no vertex's step is longer than this share of the (smallest) body's diagonal, per
        second of the step; for "static", than this share of the diagonal. None: 1e-3 1/s, or 1e-9.
    max_iterations : of Newton in one (sub)step.
    linear_solver : "pcg", "direct", or "auto": CG, and a factorization where CG stalls.
    max_substeps : a step that fails is halved until it would take more substeps than this.

    Raises
    ------
    SolverError : where a parameter is out of range.

    Source: Li, Jiang, Luo, "Physics-Based Simulation", chapters 2 to 4 and 23.
    """

    integrator: str | Integrator = "backward_euler"
    tolerance: float | None = None
    max_iterations: int = 60
    linear_solver: str = "auto"
    max_substeps: int = 64

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
        SolverError : for what this solver cannot work with: materials of XPBD, obstacles, unheld bodies where static.
        """
        if system.obstacles:
            raise SolverError(f"{system.obstacles[0].label}: Implicit has no contact yet; use XPBD, or take it out")
        if len(system.bodies) > 1:
            logger.warning(
                "Implicit has no contact yet: the scene's %d bodies pass through each other", len(system.bodies)
            )
        method = integrator_of(self.integrator)
        free_motion = FreeMotion.of(system)
        if isinstance(method, Static) and len(free_motion.totals):
            body = next(part for part in system.bodies if free_motion.piece[part.vertices].max() >= 0)
            raise SolverError(
                f"body {body.name!r}: nothing holds it, so that it has no static equilibrium; pin some of its "
                "vertices, or use another integrator"
            )
        elasticity = elasticity_of(system)
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
        return Workspace(elasticity, viscosity_of(elasticity), tools, diagonal, stabilizer_of(elasticity), stitches)

    def step(self, system: System, state: State, dt: float, workspace: Workspace) -> tuple[State, StepReport]:
        """Advance by dt, in as many substeps as it takes; see `Solver.step`.

        Raises
        ------
        SolverError : where the state has inverted tets of a material that has no energy there.
        """
        refuse_inverted(system, workspace.elasticity.material, state.positions)
        finest = 1 << int(np.log2(self.max_substeps))
        done, size = 0, finest
        begin, now = state.time, state
        rows: list[NewtonRow] = []
        substeps = 0
        worst, message = Status.CONVERGED, ""
        gradient: NDArray[np.float64] | None = None
        while done < finest:
            end = begin + dt * ((done + size) / finest)
            moved, outcome, at_end = self._substep(system, now, end, dt * (size / finest), workspace)
            rows += [replace(row, substep=substeps) for row in outcome.rows]
            good = outcome.status is Status.CONVERGED
            if not good and size > 1:
                logger.debug("step of %g s: %s; halved", dt * size / finest, outcome.status)
                size //= 2
                continue
            if not good:
                worst, message = outcome.status, outcome.message
                if not worst.can_go_on:
                    break
            now, gradient = moved, at_end
            substeps += 1
            done += size
            while size < finest and done % (2 * size) == 0 and done + 2 * size <= finest:
                size *= 2
        details = _details(rows, substeps)
        if gradient is not None:
            details["reaction_forces"], details["reaction_forces_by_vertex"] = reaction_forces(system, gradient)
        return now, StepReport(worst, sum(row.kind == "newton" for row in rows), message, details=details)

    def _substep(
        self, system: System, state: State, end: float, h: float, workspace: Workspace
    ) -> tuple[State, Outcome, NDArray[np.float64]]:
        """One step of the integrator to the time `end`; the new state, how it went, and the gradient there."""
        method = integrator_of(self.integrator)
        plan = method.plan(system, state, h, lambda start: _acceleration(system, start, workspace))
        forces = total_forces(system, end)
        guard = Guard.at(system, state.positions)
        problem = Problem(
            _objective(system, state, end, plan, forces, guard, workspace),
            plan.scale,
            self._tolerance(method) * workspace.diagonal * (1.0 if plan.scale is None else h),
            self.max_iterations,
            workspace.diagonal,
        )
        workspace.tools.linear_solver.begin_step()
        targets = system.pin_targets(end)
        pinned = workspace.tools.pinned
        x = state.positions
        rows: list[NewtonRow] = []
        if np.array_equal(targets, x[pinned]):
            x = _first_guess(system, problem, x, plan, forces, guard, pinned)
        else:
            x, carried = move_pins(system, problem, x, targets, guard, workspace.tools)
            if carried.status is not Status.CONVERGED:
                return state, carried, carried.end.gradient
            rows = carried.rows
        outcome = minimize(problem, x, guard, workspace.tools)
        outcome = replace(outcome, rows=rows + outcome.rows)
        x = outcome.end.positions
        return State(end, x, plan.velocity(x), plan.memory), outcome, outcome.end.gradient

    def _tolerance(self, method: Integrator) -> float:
        if self.tolerance is not None:
            return float(self.tolerance)
        return _STATIC_TOLERANCE if isinstance(method, Static) else _DYNAMIC_TOLERANCE


@dataclass(frozen=True, eq=False)
class Workspace:
    """What `Implicit.prepare` computes once.

    Attributes
    ----------
    diagonal : of the smallest body's bounding box at rest [m]
    """

    elasticity: Elasticity
    viscosity: Viscosity | None
    tools: Tools
    diagonal: float
    stabilizer: Stabilizer
    stitches: StitchEnergy | None


def _potentials(
    system: System, x: NDArray[np.float64], time: float, forces: NDArray[np.float64], workspace: Workspace
) -> list[Potential]:
    """Everything but inertia and damping, at `time`; energies of loads are zero at x."""
    terms: list[Potential] = [workspace.elasticity]
    if workspace.stitches is not None:
        terms.append(workspace.stitches.at(time))
    if system.gravity.any():
        terms.append(Gravity(system.masses, system.gravity, x))
    if system.forces:
        terms.append(ExternalForces(forces, x))
    if system.soft_targets:
        terms.append(soft_targets_at(system, time))
    return terms


def _objective(
    system: System,
    state: State,
    end: float,
    plan: Plan,
    forces: NDArray[np.float64],
    guard: Guard,
    workspace: Workspace,
) -> Objective:
    terms = _potentials(system, state.positions, end, forces, workspace)
    barrier = inversion_barrier(workspace.elasticity, guard.guarded)
    if barrier is not None:
        terms.append(barrier)
    if plan.scale is None:
        terms.append(workspace.stabilizer)
    else:
        terms.append(Inertia(system.masses, plan.predicted, plan.scale))
        if workspace.viscosity is not None:
            terms.append(Damping(workspace.viscosity, plan.strain_rate()))
    return Objective(terms)


def _acceleration(system: System, state: State, workspace: Workspace) -> NDArray[np.float64]:
    """(n, 3) of a state by its forces, pins aside [m/s^2].

    The inversion barrier is left out: it is a guard at the end of a step, and so stiff that the trapezoidal rule, which
    does not damp what is stiff, would throw its force back in the next step.
    """
    x, v = state.positions, state.velocities
    terms = _potentials(system, x, state.time, total_forces(system, state.time), workspace)
    if workspace.viscosity is not None:
        rate = green_strain_rates(system, x, v)
        terms.append(Damping(workspace.viscosity, StrainRate(1.0, green_strains(system, x) - rate)))
    return -Objective(terms).gradient(x) / system.masses[:, None]


def _first_guess(
    system: System,
    problem: Problem,
    x: NDArray[np.float64],
    plan: Plan,
    forces: NDArray[np.float64],
    guard: Guard,
    pinned: NDArray[np.int32],
) -> NDArray[np.float64]:
    """Where the vertices would go without elasticity, as far as the filter allows, or x where that has less energy."""
    if plan.scale is None:
        return x
    ahead = plan.predicted + plan.scale * (system.gravity + forces / system.masses[:, None])
    ahead[pinned] = x[pinned]
    step, _ = guard.largest_step(x, ahead - x)
    if step < 1.0:
        ahead = x + step * (ahead - x)
    if not guard.allows(ahead):
        return x
    return ahead if problem.objective.value(ahead) <= problem.objective.value(x) else x


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
