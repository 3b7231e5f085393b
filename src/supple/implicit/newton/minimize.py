"""Projected Newton: minimizes the objective of a step from a state without inverted tets to one without.

Directions are inexact (Eisenstat, Walker: the tolerance of the linear solver follows the decrease of the gradient),
their length is limited by the step filter, and a line search makes every iteration descend.

Sources: Li, Jiang, Luo, "Physics-Based Simulation", chapter "Optimization Framework"; Eisenstat, Walker, "Choosing the
Forcing Terms in an Inexact Newton Method" (1996), choice 2.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from supple.implicit.energies.potential import HessianBlocks
from supple.implicit.limits.step_limits import StepLimits
from supple.implicit.newton.free_motion import FreeMotion
from supple.implicit.newton.hessian_projection import Convexity, ConvexityChoice
from supple.implicit.newton.line_search import backtrack
from supple.implicit.newton.linear_solver import LinearSolver
from supple.implicit.newton.objective import Model, Objective
from supple.implicit.newton.trace import NewtonRow
from supple.implicit.timings import Clock
from supple.numerics.interruption import interruption_point
from supple.state import Status

logger = logging.getLogger(__name__)

_LOOSEST = 1e-2
_TIGHTEST = 1e-8

# Where a body buckles, its convex model is far too stiff, and Newton's steps crawl: directions that shrink by less than
# this are made longer, twice at a time, up to so many times.
_CRAWL = 0.7
_LONGEST_REACH = 16.0

# Where there is contact: the tolerance of the last linear system, and of the forces left over, relative to contact's.
_LAST = 1e-5
_BALANCE = 1e-4

# Of the largest coordinate: shorter directions are lost in rounding, and so is what they would balance.
_ROUNDED = 1e-14

# Directions that shrink by less than this from iteration to iteration converge linearly.
_LINEAR_RATE = 0.2


@dataclass(frozen=True, eq=False)
class Problem:
    """What is minimized, and when it is done.

    Attributes
    ----------
    objective : the sum of potentials
    scale : s of its inertia term [s^2], or None
    tolerance : size of the largest vertex's Newton step [m] below which the minimum is reached
    max_iterations : of Newton
    longest : largest component [m] that a direction may have where there is no inertia
    """

    objective: Objective
    scale: float | None
    tolerance: float
    max_iterations: int
    longest: float


@dataclass(frozen=True, eq=False)
class Tools:
    """What is kept from step to step: the linear solver, and the memory for Hessians."""

    linear_solver: LinearSolver
    hessian: HessianBlocks
    pinned: NDArray[np.int32]
    free_motion: FreeMotion
    clock: Clock = field(default_factory=Clock)


@dataclass(frozen=True, eq=False)
class Outcome:
    """Where a minimization ended, and how; `rows` tell of every iteration."""

    status: Status
    end: Model
    message: str = ""
    rows: list[NewtonRow] = field(default_factory=list)


def minimize(problem: Problem, x: NDArray[np.float64], limits: StepLimits, tools: Tools) -> Outcome:
    """Minimize over the free vertices from x, whose guarded tets all have positive volume."""
    here = problem.objective.model(x, tools.hessian)
    rows: list[NewtonRow] = []
    if not np.isfinite(here.energy):
        return Outcome(Status.NOT_FINITE, here, "the energy at the start of Newton's method is not finite", rows)
    forcing = _LOOSEST
    last_norm = last_length = 0.0
    choice = ConvexityChoice()
    reach = 1.0
    for iteration in range(problem.max_iterations):
        interruption_point()
        gradient = here.gradient.copy()
        gradient[tools.pinned] = 0.0
        with tools.clock.of("linear_solve"):
            tools.linear_solver.assemble(tools.hessian)
            direction, said = tools.linear_solver.solve(-gradient, forcing, choice.now is Convexity.ALL)
        while direction is None and choice.now is not Convexity.ALL:
            choice.refuse(bool(tools.hessian.couplings))
            problem.objective.model(here.positions, tools.hessian, choice.now)
            with tools.clock.of("linear_solve"):
                tools.linear_solver.assemble(tools.hessian)
                direction, said = tools.linear_solver.solve(-gradient, forcing, choice.now is Convexity.ALL)
        used = choice.now
        if direction is None or not np.isfinite(direction).all():
            return Outcome(Status.NOT_FINITE, here, "the linear system of a Newton step could not be solved", rows)
        ends = float(np.abs(direction).max(initial=0.0)) <= problem.tolerance
        touching = bool(tools.hessian.couplings)
        if ends and touching and forcing > _LAST:
            # Contact is stiff: what a loose solution leaves over is little in length, and much in force.
            with tools.clock.of("linear_solve"):
                better, more = tools.linear_solver.solve(-gradient, _LAST, used is Convexity.ALL)
            if better is not None and np.isfinite(better).all():
                direction = better
                said = replace(said, iterations=said.iterations + more.iterations)
        if problem.scale is not None:
            tools.free_motion.joined(tools.hessian.couplings).correct(direction, gradient, problem.scale)
        else:
            # Without inertia a turn may cost nothing: the direction is as long as the linear solver's errors make it.
            direction *= min(1.0, problem.longest / max(float(np.abs(direction).max(initial=0.0)), 1e-300))
        length = float(np.abs(direction).max(initial=0.0))
        last = length <= problem.tolerance
        # Bodies that recover from a tangle find their way in small steps.
        if (last and not touching) or used is not Convexity.ALL or not limits.guard.complete:
            reach = 1.0
        direction = reach * direction
        slope = float(np.einsum("ij,ij->", gradient, direction))
        largest, _ = limits.largest_step(here.positions, direction)
        step, cuts = 0.0, 0
        slow = last_length > 0.0 and length > _LINEAR_RATE * last_length
        choice.note(slow and largest == 1.0, touching)
        if slope < 0.0 and largest > 0.0:
            hessian = None if last else tools.hessian
            here, step, cuts = _guarded_search(problem, here, direction, slope, largest, limits, hessian, choice.now)
        if step == 1.0 and last_length > 0.0 and length > _CRAWL * last_length:
            reach = min(2.0 * reach, _LONGEST_REACH)
        elif step < 1.0:
            reach = max(0.5 * reach, 1.0)
        row = NewtonRow(
            iteration=iteration,
            energy=here.energy,
            force=float(np.abs(gradient).max(initial=0.0)),
            direction=length,
            linear_solver=said.method,
            linear_iterations=said.iterations,
            linear_tolerance=forcing,
            filter=largest,
            step=step,
            cuts=cuts,
            projected=used is Convexity.ALL,
        )
        rows.append(row)
        logger.debug("%s", row)
        limits.widen(here.positions)
        if last and (step == 0.0 or _is_rounded(length, here) or _in_balance(problem, here, tools)):
            return Outcome(Status.CONVERGED, here, "", rows)
        if last:
            here = problem.objective.model(here.positions, tools.hessian, choice.now)
        if step == 0.0:
            text = f"no step along Newton's direction ({length:.2e} m) lowers the energy, in iteration {iteration}"
            return Outcome(Status.LINE_SEARCH_FAILED, here, text, rows)
        if last_norm > 0.0 and said.first_norm > 0.0:
            forcing = min(_LOOSEST, max(_TIGHTEST, 0.5 * (said.first_norm / last_norm) ** 2))
        last_norm, last_length = said.first_norm, length
    text = (
        f"Newton's method took {problem.max_iterations} iterations; its last step was {rows[-1].direction:.2e} m, "
        f"the tolerance is {problem.tolerance:.2e} m"
    )
    return Outcome(Status.ITERATION_LIMIT, here, text, rows)


def _is_rounded(length: float, here: Model) -> bool:
    """Whether a direction of this length [m] changes nothing that could be told from round-off."""
    return length <= _ROUNDED * float(np.abs(here.positions).max(initial=0.0))


def _in_balance(problem: Problem, here: Model, tools: Tools) -> bool:
    """Whether what is left of the forces is small beside those of contact, which a short way changes a lot."""
    if not tools.hessian.couplings:
        return True
    left = here.gradient.copy()
    left[tools.pinned] = 0.0
    pressing = problem.objective.contact_gradient(here.positions)
    pressing[tools.pinned] = 0.0
    return bool(np.linalg.norm(left) <= _BALANCE * np.linalg.norm(pressing))


def _guarded_search(
    problem: Problem,
    start: Model,
    direction: NDArray[np.float64],
    slope: float,
    largest: float,
    limits: StepLimits,
    hessian: HessianBlocks | None,
    convexity: Convexity,
) -> tuple[Model, float, int]:
    """A line search that ends where every guarded tet has a positive volume, in rounded numbers too."""
    end, step, cuts = backtrack(problem.objective, start, direction, slope, largest, hessian, convexity)
    while step > 0.0 and not limits.allows(end.positions):
        end, step, more = backtrack(problem.objective, start, direction, slope, 0.5 * step, hessian, convexity)
        cuts += more + 1
    return end, step, cuts
