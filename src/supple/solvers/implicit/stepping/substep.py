"""One step of an integrator: its minimization problem, set up and solved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from supple.model.loads.actuators.laws import Held
from supple.model.state import State, Status
from supple.model.system import System
from supple.solvers.implicit.energies.elasticity import Elasticity
from supple.solvers.implicit.energies.inversion_barrier import inversion_barrier
from supple.solvers.implicit.energies.loads.actuators import ActuatorPotential, actuators_at, muscles_at
from supple.solvers.implicit.energies.loads.external_forces import total_forces
from supple.solvers.implicit.energies.loads.pressure import drags_at, pressures_at
from supple.solvers.implicit.energies.loads.springs import soft_targets_at, springs_at
from supple.solvers.implicit.energies.midpoint import ActingWithin
from supple.solvers.implicit.energies.potential import Potential
from supple.solvers.implicit.energies.rods import RodEnergy
from supple.solvers.implicit.energies.shells import ShellEnergy
from supple.solvers.implicit.energies.vertex_potential import VertexPotential, inertia
from supple.solvers.implicit.inversion_guard import InversionGuard
from supple.solvers.implicit.newton.hessian_projection import ProjectedTerms
from supple.solvers.implicit.newton.linearize import FEW, linearize
from supple.solvers.implicit.newton.minimize import Convergence, Outcome, Problem, minimize
from supple.solvers.implicit.newton.objective import Objective
from supple.solvers.implicit.newton.trace import NewtonRow
from supple.solvers.implicit.step_limits import StepLimits, are_in_pieces
from supple.solvers.implicit.stepping.contact_step import ContactStep
from supple.solvers.implicit.stepping.dirichlet import move_pins
from supple.solvers.implicit.stepping.integrators import Integrator, Plan, Static
from supple.solvers.implicit.stepping.joint_step import JointStep
from supple.solvers.implicit.stepping.rigid_bodies import with_rigid_bodies
from supple.solvers.implicit.stepping.works import makes_energy, works_of_step
from supple.solvers.implicit.stepping.workspace import Workspace

# The defaults of `Implicit.tolerance`. Halving the first is meant to move results by less than 1e-4; an equilibrium has
# no later steps that would make up for the rest. What is left is an error of the velocity in every step. It falls with
# the square of the step, as shorter steps would otherwise add more of it, but not to less than round-off leaves.
_DYNAMIC_TOLERANCE = 1e-3
_STATIC_TOLERANCE = 1e-9

# Of `dhat`, over which contact's force goes from zero to its full size, and of the displacement below which friction is
# static: steps have to resolve both.
_DHAT_SHARE = 0.1
_FRICTION_SHARE = 1e-2

# Pinned bodies start where they go on as they do, if the filters allow this share of the way: less of it leaves
# surfaces that are nearer than forces would allow.
_WORTHWHILE = 0.3

# Each one takes nine tenths of the distance to what is ahead, until it is near enough to touch.
_MOST_APPROACHES = 3


@dataclass(frozen=True)
class StepSettings:
    """The settings of a step; see `Implicit`."""

    integrator: Integrator
    tolerance: float | None
    force_tolerance: float
    max_iterations: int
    volume_kept: float
    barrier_onset: float

    @property
    def linearized(self) -> bool:
        """Whether a step is a few linearizations, and not a minimization."""
        return self.max_iterations <= FEW

    def shortest(self, workspace: Workspace, h: float, memory: object) -> float:
        """The length of Newton's step [m] below which the minimum of a step of h [s] is reached.

        memory : of the integrator, None where a history begins
        """
        static = isinstance(self.integrator, Static)
        if self.tolerance is not None:
            return float(self.tolerance) * workspace.diagonal * (1.0 if static else h)
        length, coarse = _STATIC_TOLERANCE, _DYNAMIC_TOLERANCE * h
        if not static:
            method = (self.integrator.without_history if memory is None else None) or self.integrator
            length = min(max(length, coarse * (h / method.precise_below) ** 2), coarse)
        length *= workspace.diagonal
        contact = workspace.contact
        if contact is not None:
            length = min(length, _DHAT_SHARE * contact.scales.dhat)
            if contact.coefficients.any():
                length = min(length, _FRICTION_SHARE * contact.scales.friction_velocity * h)
        return length


@dataclass(frozen=True, eq=False)
class Ending:
    """What has led a substep from a state to its end.

    `Workspace.settle`, if any, gives a converged one another outcome, and contact, joints and actuators of that.
    """

    before: State
    end: float
    h: float
    settings: StepSettings
    outcome: Outcome
    contact: ContactStep
    joints: JointStep | None

    @property
    def held(self) -> list[Held]:
        """The laws of actuators with a given coordinate."""
        laws = (term.law for term in self.contact.objective.terms if isinstance(term, ActuatorPotential))
        return [law for law in laws if isinstance(law, Held)]


@dataclass(frozen=True, eq=False)
class Substep:
    """The result of a step: the state at its end, the course of Newton's method, contact and joints at the end.

    actuators : generalized forces of each actuator, as they acted in the step; works, residual : see `works_of_step`
    time_error : see `ImplicitDetails`
    ending : what led to its end, where it reached that
    """

    state: State
    outcome: Outcome
    contact: ContactStep
    joints: JointStep | None
    actuators: tuple[NDArray[np.float64], ...] = ()
    works: dict[str, float] = field(default_factory=dict)
    residual: float = 0.0
    time_error: float | None = None
    ending: Ending | None = None


def take_substep(
    state: State, end: float, h: float, settings: StepSettings, workspace: Workspace, divisible: bool
) -> Substep | None:
    """One step of length h [s] to the time `end` [s], from a state with the obstacles' vertices.

    None where it is `divisible` and things would penetrate each other if they went on as they do.

    Where its integrator makes energy of the velocities before a blow, the step is taken again without its history.
    """
    taken = _take(state, end, h, settings, workspace, divisible)
    method = settings.integrator.without_history
    if (
        taken is None
        or method is None
        or state.memory is None
        or taken.outcome.status not in (Status.CONVERGED, Status.LINEARIZED)
    ):
        return taken
    balance = taken.works, taken.residual, taken.actuators
    open_speed = settings.shortest(workspace, h, state.memory) / h
    if not makes_energy(state, taken.state, *balance, open_speed, workspace):
        return taken
    again = _take(state, end, h, replace(settings, integrator=method), workspace, False)
    assert again is not None
    return replace(again, outcome=replace(again.outcome, rows=taken.outcome.rows + again.outcome.rows))


@dataclass(frozen=True, eq=False)
class Posed:
    """A step as its state and its system pose it, before anything is solved.

    Attributes
    ----------
    targets : (k, 3) of the pinned vertices at the end [m]; middle : where loads are taken [s]; forces : (n, 3) [N]
    base : the objective without joints and contact
    """

    plan: Plan
    targets: NDArray[np.float64]
    middle: float
    forces: NDArray[np.float64]
    guard: InversionGuard
    grown: Elasticity
    actuators: list[ActuatorPotential]
    base: Objective
    joints: JointStep | None
    contact: ContactStep

    def limits(self, workspace: Workspace) -> StepLimits:
        """Of Newton's steps."""
        return StepLimits(self.guard, workspace.contact, workspace.tools.clock)


def pose(state: State, end: float, h: float, settings: StepSettings, workspace: Workspace) -> Posed:
    """The step of h [s] that ends at `end` [s]."""
    system = workspace.system
    targets = system.pin_targets(end)
    obstacles = len(state.positions) - workspace.bodies_end
    if obstacles:
        # What a script moves has the script's velocity, so that its inertia plays no part.
        state.velocities[workspace.bodies_end :] = (targets[-obstacles:] - state.positions[-obstacles:]) / h
    plan = settings.integrator.plan(system, state, h)
    middle = end - (1.0 - plan.place) * h
    forces = total_forces(system, state.positions, middle)
    guard = InversionGuard.at(system, state.positions, settings.volume_kept)
    grown = workspace.elasticity_at(middle)
    elasticity = grown.in_step(state.internal, h)
    mu = workspace.elasticity.material.mu
    actuators = actuators_at(system, state.positions, (state.time, middle), plan.scale, mu)
    terms = [*actuators, *drags_at(system, state, *plan.motion(state), middle)]
    base = stored_and_loaded(elasticity, state.positions, middle, plan, forces, workspace, terms)
    onset = settings.barrier_onset
    barriers = (inversion_barrier(workspace.elasticity, guard.guarded, onset), guard.quadratic_barrier(onset))
    base = replace(base, terms=[*base.terms, *(barrier for barrier in barriers if barrier is not None)])
    times = state.time, end
    joints = None if workspace.joints is None else JointStep.of(workspace.joints, state, times, plan.scale)
    contact = ContactStep(workspace.contact, state.positions, times, plan.contact_weight, settings.linearized)
    return Posed(plan, targets, middle, forces, guard, grown, actuators, base, joints, contact)


def _take(
    state: State, end: float, h: float, settings: StepSettings, workspace: Workspace, divisible: bool
) -> Substep | None:
    system, tools = workspace.system, workspace.tools
    posed = pose(state, end, h, settings, workspace)
    targets, plan, forces, middle = posed.targets, posed.plan, posed.forces, posed.middle
    base, joints, contact, grown, actuators = posed.base, posed.joints, posed.contact, posed.grown, posed.actuators
    onwards = _without_forces(system, plan, targets)
    if divisible and workspace.contact is not None and workspace.contact.passing(state.positions, onwards):
        return None
    limits = posed.limits(workspace)
    still = np.array_equal(targets, state.positions[tools.pinned])
    objective = _with_joints(base, joints)
    if not (still and settings.linearized):  # a linearization has the contact of where it begins
        objective = contact.with_contact(objective, state.positions)
    problem = Problem(
        objective,
        plan.scale,
        Convergence(settings.shortest(workspace, h, state.memory), settings.force_tolerance),
        settings.max_iterations,
        workspace.diagonal,
        contact.friction_is_outdated,
        renewed=lambda x: contact.with_contact(_with_joints(base, joints), x),
    )
    tools.linear_solver.begin_step()
    x = state.positions
    rows: list[NewtonRow] = []
    if still:
        ahead = _without_elasticity(system, x, plan, forces, tools.pinned)
        if settings.linearized:
            x = _linearized_at(x, ahead, plan.predicted, limits)
        else:
            x = _first_guess(problem, x, ahead, limits)
    else:
        x = _going_on(x, onwards, limits) if plan.scale is not None else x
        x, moved = move_pins(system, problem, x, targets, limits, tools)
        rows = moved.rows
        if moved.status is not Status.CONVERGED:
            return Substep(state, moved, contact, joints)
    while True:
        outcome = (linearize if settings.linearized else minimize)(problem, x, limits, tools)
        rows = rows + outcome.rows
        x = outcome.end.positions
        if outcome.status is not Status.CONVERGED:
            break
        updated = joints is not None and joints.update(x)
        if not contact.needs_update(x, outcome.unbalanced) and not updated:
            break
        objective = contact.with_contact(_with_joints(base, joints), x)
        problem = replace(problem, objective=objective, projected=ProjectedTerms.RELEASED_LAST)
    ending = Ending(state, end, h, settings, outcome, contact, joints)
    if workspace.settle is not None and outcome.status is Status.CONVERGED:
        outcome = workspace.settle(ending, workspace)
        x, ending = outcome.end.positions, replace(ending, outcome=outcome)
    outcome = contact.verified(replace(outcome, rows=rows))
    if joints is not None:
        outcome = joints.verified(outcome)
    internal = grown.flowed(x, state.internal, h)
    angles = {} if joints is None else joints.hinge_angles(x)
    after = State(end, x, plan.velocity(x), plan.memory, internal=internal, hinge_angles=angles)
    residual = plan.place * outcome.end.gradient
    after = settings.integrator.finish(plan, state, after, residual, workspace.conservation)
    damping = (term for term in problem.objective.terms if term.work == "damping")
    gained = workspace.conservation.gained(state, after, damping, plan.place)
    if gained is not None and outcome.status is Status.CONVERGED:
        share, name = gained
        text = f"{100.0 * share:.2g} % of the energy of body {name!r} has no source; take a shorter step"
        outcome = replace(outcome, status=Status.ENERGY_GAINED, message=text)
    acted = state.positions + plan.place * (x - state.positions)
    forces_of_actuators = tuple(actuator.forces(acted) for actuator in actuators)
    works, residual = works_of_step(contact.objective, outcome, state, internal, plan, middle, end, workspace)
    error = _time_error(system, workspace.bodies_end, settings.integrator.position_error(state, after))
    return Substep(after, outcome, contact, joints, forces_of_actuators, works, residual, error, ending)


def _time_error(system: System, n: int, error: NDArray[np.float64] | None) -> float | None:
    """The root mean square over the mass of the bodies' n vertices [m]."""
    if error is None:
        return None
    masses = system.masses[:n]
    return float(np.sqrt(masses @ np.einsum("ij,ij->i", error[:n], error[:n]) / masses.sum()))


def _with_joints(objective: Objective, joints: JointStep | None) -> Objective:
    """The objective with the present energy of the joints."""
    return objective if joints is None else replace(objective, terms=[*objective.terms, joints.potential])


def stored_and_loaded(
    elasticity: Elasticity,
    x: NDArray[np.float64],
    time: float,
    plan: Plan,
    forces: NDArray[np.float64],
    workspace: Workspace,
    more: Sequence[Potential],
) -> Objective:
    """All but contact and the inversion barrier, with the loads of `time` [s]; energies of loads are zero at x."""
    system = workspace.system
    terms: list[Potential] = [elasticity]
    if system.shells is not None:
        terms.append(ShellEnergy(system.shells))
    if system.rods is not None:
        terms.append(RodEnergy(system.rods))
    if workspace.stitches is not None:
        terms.append(workspace.stitches.at(time))
    if forces.any():
        terms.append(VertexPotential(x, np.zeros_like(x), forces))
    terms += soft_targets_at(system, time)
    terms += pressures_at(system, x, time)
    terms += springs_at(system, time)
    terms += muscles_at(system, time)
    terms += more
    if plan.scale is not None:
        terms += [damper.damping(plan.strain_rate(damper)) for damper in workspace.dampers]
    if plan.place != 1.0:
        terms = [ActingWithin(term, x, plan.place) for term in terms]
    terms.append(workspace.regularization if plan.scale is None else inertia(system.masses, plan.predicted, plan.scale))
    return Objective(terms, workspace.tools.clock)


def _without_forces(system: System, plan: Plan, targets: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where everything goes on as it does, with rigid bodies rigid and pins at `targets`."""
    ahead = with_rigid_bodies(system, plan.predicted.copy())
    ahead[system.pinned_vertices] = targets
    system.welding.follow(ahead)
    return ahead


def _without_elasticity(
    system: System, x: NDArray[np.float64], plan: Plan, forces: NDArray[np.float64], pinned: NDArray[np.int32]
) -> NDArray[np.float64]:
    """The positions at the end without elasticity and contact, with rigid bodies rigid."""
    if plan.scale is None:
        return x
    ahead = plan.predicted + plan.scale / plan.place * forces / system.masses[:, None]
    ahead = with_rigid_bodies(system, ahead)
    ahead[pinned] = x[pinned]
    system.welding.follow(ahead)
    return ahead


def _linearized_at(
    x: NDArray[np.float64], ahead: NDArray[np.float64], inertial: NDArray[np.float64], limits: StepLimits
) -> NDArray[np.float64]:
    """Where one linearization is best: `ahead`, each piece of bodies as far as the filters allow.

    What touches goes on as it does, `inertial` (n, 3), and keeps half of its distance or more: forces would press it
    onto what carries it, and contact is linearized where it acts.
    """
    contact, pieces = limits.contact, limits.guard.system.joined_components
    place, share = x, np.ones((len(x), 1))
    if contact is not None:
        touching = contact.vertices(np.unique(contact.collisions.at(x).points))
        share[are_in_pieces(touching, pieces)] = 0.5
        ahead = np.where(share == 1.0, ahead, inertial)
    for _ in range(_MOST_APPROACHES):
        way, limit = limits.shortened(place, ahead - place, share)
        if not limits.allows(place + way):
            break
        place = place + way
        if limit.step == 1.0 or contact is None or np.isfinite(contact.smallest_distance(place)):
            break
    return place


def _going_on(x: NDArray[np.float64], ahead: NDArray[np.float64], limits: StepLimits) -> NDArray[np.float64]:
    """The positions `ahead` as far as the filters allow; x where that is near."""
    step = limits.largest_step(x, ahead - x).step
    ahead = ahead if step == 1.0 else x + step * (ahead - x)
    return ahead if step >= _WORTHWHILE and limits.allows(ahead) else x


def _first_guess(
    problem: Problem, x: NDArray[np.float64], ahead: NDArray[np.float64], limits: StepLimits
) -> NDArray[np.float64]:
    """The positions `ahead` as far as the filters allow; x where that has less energy."""
    step = limits.largest_step(x, ahead - x).step
    if step < 1.0:
        ahead = x + step * (ahead - x)
    if not limits.allows(ahead):
        return x
    return ahead if problem.objective.value(ahead) <= problem.objective.value(x) else x
