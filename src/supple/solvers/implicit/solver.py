"""`Implicit`: implicit time integration of finite elements that never invert."""

from __future__ import annotations

import logging
from dataclasses import dataclass, field, replace
from typing import Annotated, ClassVar

import numpy as np

from supple.errors import SolverError
from supple.kinds.validators import COUNT, POSITIVE, SHARE, Choice, Number, OneOf
from supple.materials.laws.internal import checked
from supple.model.actuator_readings import actuator_fields, start_of
from supple.model.energy_balance import add_works, no_works, works_of_actuators
from supple.model.joints.at_state import initial_joint_details, refuse_apart, refuse_moved_welds
from supple.model.joints.geometry import JointGeometry
from supple.model.pin_reactions import pin_reactions
from supple.model.state import State, Status, StepReport
from supple.model.stitched_points import with_stitched_points
from supple.model.system import System
from supple.numerics.inner_product import norm
from supple.numerics.noninverting_step import KEEP
from supple.runtime.threads import threads_for
from supple.scene.scene import Scene
from supple.scene.shell import Shell
from supple.solvers.implicit.contact.model import contact_model
from supple.solvers.implicit.contact.points import forces_on_owners
from supple.solvers.implicit.contact.settings import IPCContact, smallest_diagonal
from supple.solvers.implicit.details import ImplicitDetails
from supple.solvers.implicit.energies.damping import quadratic_viscosity_of, viscosity_of
from supple.solvers.implicit.energies.elasticity import elasticity_of, refuse_materials
from supple.solvers.implicit.energies.potential import HessianBlocks
from supple.solvers.implicit.energies.regularization import regularization_of
from supple.solvers.implicit.energies.rods import RodViscosity
from supple.solvers.implicit.energies.shells import ShellViscosity
from supple.solvers.implicit.energies.stitch_damping import StitchViscosity
from supple.solvers.implicit.energies.stitches import StitchEnergy
from supple.solvers.implicit.inversion_guard import refuse_inverted
from supple.solvers.implicit.newton.direction import Tools
from supple.solvers.implicit.newton.free_motion import FreeMotion
from supple.solvers.implicit.newton.linear_solver import LinearSolver
from supple.solvers.implicit.newton.trace import NewtonRow
from supple.solvers.implicit.stepping.integrators import (
    INTEGRATORS,
    History,
    Integrator,
    Static,
    integrator_of,
)
from supple.solvers.implicit.stepping.lost_energy import lost_in_flow
from supple.solvers.implicit.stepping.rigid_bodies import orthogonality_errors, weld_forces
from supple.solvers.implicit.stepping.substep import StepSettings, Substep, take_substep
from supple.solvers.implicit.stepping.substepping import Substepping
from supple.solvers.implicit.stepping.workspace import Workspace
from supple.solvers.implicit.timings import PARTS
from supple.solvers.solver import Solver

logger = logging.getLogger(__name__)

# Measured on cubes: 2900 bytes per tet; for a factorization 870 bytes times the
# number of vertices to the power 4/3, as the factor of a solid body grows. The margin is for contact.
_BYTES_PER_TET = 5000
_BYTES_OF_FACTOR = 1200
# Beyond the above, for the matrices of its quadrature points and its blocks: 45,000 on a cube of 6,000.
_BYTES_PER_QUADRATIC_TET = 50_000
# Of shells, for their stencils' matrices and the two factorizations.
_BYTES_PER_TRIANGLE = 25_000
# Tets from which two threads pay for the time that it takes to compile the kernels' parallel forms.
_SHARED_FROM = 1_500


@dataclass(frozen=True)
class Implicit(Solver):
    """Implicit integration by projected Newton with a step filter: in a body without inverted tets none ever inverts.

    Parameters
    ----------
    integrator : "backward_euler", "bdf2", "newmark" (midpoint; without rigid bodies), "static", or an `Integrator`.
    tolerance : Newton stops when no vertex's step is longer than this share of the (smallest) body's diagonal, per
        second of the step [1/s]; for "static", than this share of the diagonal [-]. None: 1e-9, or 1e-3 1/s, and less
        with the square of steps below 1/15 s (backward Euler: 1/60 s); where there is contact no longer than a tenth of
        `dhat`, with friction than a hundredth of `friction_velocity`.
    force_tolerance : where surfaces touch, Newton also goes on until the remaining forces are below this share of
        contact's [-].
    max_iterations : of Newton in one (sub)step. 1 to 3: that many linearizations, for real time, and up to 3 where
        contact or an inversion cuts the step, which is not divided. Tets do not invert and surfaces do not cross. Where
        forces remain, the status is `linearized`; `details.unbalanced_force` and the message name them.
    linear_solver : "pcg", "direct", or "auto": CG, and a factorization where CG stalls.
    max_substeps : largest number of substeps: a step that fails is halved. Steps in which scripts turn far are first
        divided into straight pieces (1024 at most), each of which may take this number. 1: never divided.
    path_tolerance : how far a script may go off the straight line within a piece, as a share of the (smallest) body's
        diagonal [-].
    volume_kept : share of its volume that a tet keeps at least in one Newton iteration, above 0 and below 1 [-].
    barrier_onset : J = det F below which a barrier against inversion acts on materials that have a finite energy at
        J = 0, above 0 and at most 1 [-]. Stress and energy are the material's alone above it.
    contact : of bodies with each other, with themselves and with obstacles; None turns it off.

    Raises
    ------
    SolverError : where a parameter is out of range.

    Source: Li, Jiang, Luo, "Physics-Based Simulation", chapters 2 to 4 and 23.
    """

    kind: ClassVar[str] = "implicit"

    integrator: Annotated[str | Integrator, Choice(tuple(INTEGRATORS), Integrator)] = "backward_euler"
    tolerance: Annotated[float | None, POSITIVE] = None
    force_tolerance: Annotated[float, SHARE] = 1e-4
    max_iterations: Annotated[int, COUNT] = 120
    linear_solver: Annotated[str, Choice(("auto", "pcg", "direct"))] = "auto"
    max_substeps: Annotated[int, COUNT] = 64
    path_tolerance: Annotated[float, POSITIVE] = 0.05
    volume_kept: Annotated[float, SHARE] = KEEP
    barrier_onset: Annotated[float, Number(above=0.0, most=1.0)] = 0.1
    contact: Annotated[IPCContact | None, OneOf((IPCContact,), "IPCContact(...), or None to turn it off")] = field(
        default_factory=IPCContact
    )

    def bytes_needed(self, scene: Scene) -> int:
        """Estimate of the memory that a simulation takes beyond that of the program itself [bytes]."""
        needed = 0
        for body in scene.bodies:
            per_tet = _BYTES_PER_TET + (_BYTES_PER_QUADRATIC_TET if body.mesh.order == 2 else 0)
            needed += per_tet * len(body.mesh.tets)
            if isinstance(body, Shell):
                needed += _BYTES_PER_TRIANGLE * len(body.triangles)
        if self.linear_solver == "direct":
            needed += int(_BYTES_OF_FACTOR * sum(len(body.mesh.vertices) ** (4.0 / 3.0) for body in scene.bodies))
        return needed

    def refuse(self, system: System) -> None:
        """Raise for materials of XPBD, and for what the integrator refuses.

        Raises
        ------
        SolverError : the text names the body or joint.
        """
        if refusal := integrator_of(self.integrator).refusal(system):
            raise SolverError(refusal)
        refuse_materials(system)

    def prepare(self, system: System, tools: Tools | None = None) -> Workspace:
        """Compute the patterns, groups and memory for a system.

        Parameters
        ----------
        tools : of a system with the same tets, pins and welds; None: they are made

        Raises
        ------
        SolverError : for what this solver does not support: materials of XPBD, obstacles without contact, free bodies
            with the static integrator, and what an integrator refuses.
        """
        method, system = integrator_of(self.integrator), with_stitched_points(system)
        self.refuse(system)
        elasticity = elasticity_of(system)
        contact = None
        if self.contact is not None:
            contact = contact_model(system, self.contact, elasticity.material.mu)
            if contact.system is not system:
                system = contact.system
                elasticity = elasticity_of(system)
        elif system.obstacles:
            raise SolverError(
                f"{system.obstacles[0].label}: with contact=None obstacles have no effect; give contact=IPCContact(), "
                "or remove them"
            )
        free_motion = FreeMotion.of(system) if tools is None else tools.free_motion
        if isinstance(method, Static) and len(free_motion.totals):
            body = next(part for part in system.bodies if free_motion.piece[part.vertices].max() >= 0)
            raise SolverError(
                f"body {body.name!r}: nothing holds it, so that it has no static equilibrium; pin some of its "
                "vertices, or use another integrator"
            )
        if tools is None:
            with threads_for(len(system.tets), _SHARED_FROM):
                linear_solver = LinearSolver.of(system, self.linear_solver)
            hessian = HessianBlocks.zeros(len(system.tets), len(system.rest_positions), len(system.stitching))
            tools = Tools(linear_solver, hessian, system.pinned_vertices, free_motion)
        stitches = StitchEnergy.of(system.stitching, 0.0) if len(system.stitching) else None
        dampers = (
            viscosity_of(elasticity),
            quadratic_viscosity_of(elasticity),
            StitchViscosity.of(system.stitching),
            ShellViscosity.of(system.shells),
            RodViscosity.of(system.rods),
        )
        return Workspace(
            system,
            contact,
            elasticity,
            tools,
            smallest_diagonal(system),
            regularization_of(system),
            stitches,
            tuple(damper for damper in dampers if damper is not None),
            JointGeometry.of(system) if system.scene.joints else None,
        )

    def check(self, system: System, state: State, workspace: Workspace) -> None:
        """Raise where a step cannot start from `state`; see `Solver.check`.

        Raises
        ------
        SceneError : where surfaces intersect, or a body is inside something solid.
        SolverError : where surfaces touch, or a tet is inverted whose material has no energy there.
        """
        refuse_inverted(system, workspace.elasticity.material, state.positions)
        refuse_moved_welds(system, state)
        if workspace.joints is not None:
            refuse_apart(workspace.joints, state)
        if workspace.contact is not None:
            workspace.contact.raise_if_intersecting(workspace.extended(state).positions, state.time)
        workspace.checked = state

    def initial_details(self, system: System, workspace: Workspace) -> ImplicitDetails:
        """No iterations, and all forces zero; see `Solver.initial_details`."""
        zero = np.zeros((len(workspace.system.rest_positions), 3))
        pushes = {} if workspace.contact is None else forces_on_owners(workspace.contact, zero)
        return ImplicitDetails(
            contact_forces=pushes,
            friction_forces=pushes,
            reaction_forces=pin_reactions(system, zero)[0],
            weld_forces=weld_forces(system, zero),
            orthogonality_errors=dict.fromkeys((part.name for part in system.rigid_bodies), 0.0),
            **initial_joint_details(workspace.joints, workspace.checked or system.start_states[-1]),
            seconds=dict.fromkeys((*PARTS, "other"), 0.0),
            **actuator_fields(system, *start_of(system)),
            work=no_works(system),
        )

    def step(self, system: System, state: State, dt: float, workspace: Workspace) -> tuple[State, StepReport]:
        """Advance by dt in one or more substeps; see `Solver.step`.

        Raises
        ------
        SceneError, SolverError : see `check`, which is called here for a state that is not known to pass it.
        """
        workspace.tools.clock.restart()
        solves, searches = workspace.counts
        if workspace.checked is None or state.positions is not workspace.checked.positions:
            self.check(system, state, workspace)
        state = replace(state, internal=checked(system.laws.material, state.internal))
        n = len(state.positions)
        state = workspace.extended(state)
        substepping = Substepping.of(
            workspace.system, state.time, dt, self.path_tolerance * workspace.diagonal, self.max_substeps
        )
        now = state
        settings = StepSettings(
            integrator_of(self.integrator),
            self.tolerance,
            self.force_tolerance,
            self.max_iterations,
            self.volume_kept,
            self.barrier_onset,
        )
        rows: list[NewtonRow] = []
        substeps = 0
        worst, message = Status.CONVERGED, ""
        last: Substep | None = None
        forces, parts, works = start_of(system)
        parts = [each.parts(now.positions) for each in system.actuators]
        energy, residual = no_works(system), 0.0
        time_error: float | None = None
        while not substepping.over:
            with threads_for(len(system.tets), _SHARED_FROM), workspace.tools.linear_solver.own_threads():
                span = substepping.end, substepping.length
                taken = take_substep(now, *span, settings, workspace, substepping.divisible)
            if taken is None:
                substepping.divide()
                continue
            rows += [replace(row, substep=substeps) for row in taken.outcome.rows]
            if taken.outcome.status is not Status.CONVERGED:
                logger.debug("step of %g s: %s", substepping.length, taken.outcome.status)
                linearized = taken.outcome.status is Status.LINEARIZED
                tunnelled = taken.outcome.status is Status.TUNNELLED
                if not linearized and (substepping.divide() if tunnelled else substepping.halve()):
                    continue
                message = taken.outcome.message if linearized else _limit_message(taken.outcome.message, substepping)
                worst = taken.outcome.status
                if not worst.can_go_on:
                    break
            if workspace.tape is not None:
                workspace.tape.append(taken.ending)
            now, last = taken.state, taken
            before, parts = parts, [each.parts(now.positions) for each in system.actuators]
            forces = list(taken.actuators)
            works = [w + Q * (s - t) for w, Q, s, t in zip(works, forces, parts, before, strict=True)]
            add_works(energy, taken.works)
            residual += taken.residual
            if taken.time_error is not None:
                time_error = (time_error or 0.0) + taken.time_error
            substeps += 1
            substepping.advance()
        add_works(energy, works_of_actuators(system, works))
        now = replace(now, positions=now.positions[:n], velocities=now.velocities[:n])
        if system.laws.material.flowing_laws and isinstance(now.memory, History) and last is not None:
            start = replace(state, positions=state.positions[:n], velocities=state.velocities[:n])
            so_far = state.memory.lost if isinstance(state.memory, History) else (0.0, 0.0)
            touching = last.contact.touching(last.state.positions)
            lost, text = lost_in_flow(system, start, now, energy, residual, touching[touching < n], so_far)
            now = replace(now, memory=replace(now.memory, lost=lost))
            if worst is Status.CONVERGED and text is not None:
                worst, message = Status.TIME_STEP, text
        workspace.checked = now
        details = replace(
            ImplicitDetails.of_rows(rows, substeps),
            linear_solves=workspace.counts[0] - solves,
            work=energy,
            energy_residual=residual,
            time_error=time_error,
            orthogonality_errors=orthogonality_errors(system, now.positions),
            **actuator_fields(system, forces, parts, works),
        )
        nearest, contacts = None, None
        if last is not None:
            gradient = last.outcome.end.gradient / last.contact.weight
            left, of_welds = norm(workspace.tools.freed(gradient)), weld_forces(system, gradient)
            totals, by_vertex = pin_reactions(system, workspace.system.welding.reduced(gradient))
            details = replace(details, unbalanced_force=left, weld_forces=of_welds)
            details = replace(details, reaction_forces=totals, reaction_forces_by_vertex=by_vertex)
            details, nearest, contacts = last.contact.measured(details, last.state.positions)
            if last.joints is not None:
                details = last.joints.measured(details, last.outcome.end.positions)
        searches = workspace.counts[1] - searches
        details = replace(details, searches=searches, seconds=workspace.tools.clock.shares())
        return now, StepReport(worst, details.newton_iterations, message, nearest, details, contacts)


def _limit_message(message: str, substepping: Substepping) -> str:
    """Why a substep failed that may not be shorter."""
    if substepping.halves == 1:
        return message
    return f"{message}; in a substep of {substepping.length:.3g} s, the shortest that max_substeps allows"
