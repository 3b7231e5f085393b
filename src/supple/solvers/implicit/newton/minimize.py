"""Projected Newton: minimizes the objective of a step from a state without inverted tets to one without.

Three parts: the direction (`direction`), the step along it (`line_search`), and the end (`Convergence`).

Source: Li, Jiang, Luo, "Physics-Based Simulation", chapter "Optimization Framework".
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from supple.model.state import Status
from supple.numerics.inner_product import norm
from supple.solvers.implicit.newton.direction import DirectionFinder, Tools, newton_row
from supple.solvers.implicit.newton.hessian_projection import ProjectedTerms, ProjectionPolicy
from supple.solvers.implicit.newton.line_search import Jumps, extended, search
from supple.solvers.implicit.newton.objective import Model, Objective
from supple.solvers.implicit.newton.trace import NewtonRow
from supple.solvers.implicit.step_limits import StepLimits

# Of the largest coordinate: shorter directions are lost in rounding (45 units of 2^-52), and so is the force that they
# would balance.
_ROUNDED = 1e-14


@dataclass(frozen=True)
class Convergence:
    """The conditions.

    Attributes
    ----------
    step : largest component of a Newton direction at the minimum [m]
    force : where surfaces touch, the norm of the remaining forces, relative to that of contact's forces: contact is so
        stiff that a short step can change large forces
    """

    step: float
    force: float

    def is_short(self, length: float) -> bool:
        """Whether a direction with this largest component [m] is the last one."""
        return length <= self.step

    def is_reached(self, length: float, extent: float, residual: float, contact: float | None) -> bool:
        """Whether the end of a step along such a direction is the minimum.

        Parameters
        ----------
        length : largest component of the direction [m]; extent : largest coordinate [m]
        residual, contact : norms of all forces on free vertices and of contact's [N]; None where nothing touches
        """
        if not self.is_short(length):
            return False
        return contact is None or length <= _ROUNDED * extent or residual <= self.force * contact


logger = logging.getLogger(__name__)

# Directions that shrink by less than this factor converge linearly: Newton's method with the true Hessian is faster.
_LINEAR_RATE = 0.2

# Those that shrink by less than this one crawl, and their steps may be made longer.
_CRAWL = 0.5

# Forces are nearly balanced where their sum is below this share of contact's: what is left would be lost work where
# friction is renewed.
_NEARLY = 0.1


# After this many steps in a row that change the energy by less than this share of its terms, and with balanced forces,
# a lower minimum cannot be distinguished from round-off: the remaining steps alternate across the kinks of frictionless
# contact.
_SETTLED = 6
_NOTHING = 1e-12


@dataclass(frozen=True, eq=False)
class Problem:
    """The function to minimize, and the conditions at its minimum.

    Attributes
    ----------
    objective : the sum of potentials
    scale : s of its inertia term [s^2], or None
    convergence : when the minimum is reached
    max_iterations : of Newton
    longest : largest component [m] that a direction may have without inertia
    outdated : whether the objective is due for a change at positions (n, 3) where this share of contact's forces is not
        balanced
    projected : the terms that are projected at first
    renewed : the objective with friction of the contacts at positions (n, 3), where a linearization begins
    """

    objective: Objective
    scale: float | None
    convergence: Convergence
    max_iterations: int
    longest: float
    outdated: Callable[[NDArray[np.float64], float], bool] | None = None
    projected: ProjectedTerms = ProjectedTerms.ALL
    renewed: Callable[[NDArray[np.float64]], Objective] | None = None


@dataclass(frozen=True, eq=False)
class Outcome:
    """The end of a minimization, and its status; `rows` describe every iteration.

    unbalanced : share of contact's forces that is left where the objective is due for a change, else 0
    """

    status: Status
    end: Model
    message: str = ""
    rows: list[NewtonRow] = field(default_factory=list)
    unbalanced: float = 0.0


def minimize(problem: Problem, x: NDArray[np.float64], limits: StepLimits, tools: Tools) -> Outcome:
    """Minimize over the free vertices from x, whose guarded tets all have positive volume."""
    objective, convergence, hessian = problem.objective, problem.convergence, tools.hessian
    policy, jumps = ProjectionPolicy(problem.projected), Jumps()
    directions = DirectionFinder(objective, tools, problem.scale, convergence.step, problem.longest, policy=policy)
    here = objective.model(x, hessian, policy.now)
    rows: list[NewtonRow] = []
    if not np.isfinite(here.energy):
        return Outcome(Status.NOT_FINITE, here, "the energy at the start of Newton's method is not finite", rows)
    last_length = 0.0
    settled = 0
    # A tet that a cut step has pressed flat is so stiff that its large forces give a short direction.
    pressed = False
    for iteration in tools.linear_solver.iterations(problem.max_iterations):
        found = directions.find(here)
        if found is None:
            return Outcome(Status.NOT_FINITE, here, "the linear system of a Newton step could not be solved", rows)
        last = convergence.is_short(found.length) and not pressed
        rate = found.length / last_length if last_length > 0.0 else 0.0
        vector = found.vector
        largest, tet, reason, _ = limits.largest_step(here.positions, vector)
        pressed = largest < 1.0 and tet >= 0
        end, step, cuts = search(objective, here, vector, found.slope, largest, limits, jumps)
        # True Hessians do not need longer steps, and bodies with inverted tets recover in small ones.
        projected = found.projected is not ProjectedTerms.NONE and limits.guard.complete
        if step == 1.0 and rate > _CRAWL and not last and projected:
            end, step = extended(objective, here, vector, found.slope, end, limits)
        # Where the step is shorter, the duals of the whole direction are those that the next matrix needs, too.
        objective.renew(here.positions, vector)
        policy.note(rate > _LINEAR_RATE and largest == 1.0, found.touching)
        before = here.energy
        if step > 0.0:
            # A last step most often needs no Hessian at its end.
            here = objective.model(end, None if last else hessian, policy.now)
        row = newton_row(iteration, here.energy, found, (largest, step, cuts), reason)
        rows.append(row)
        settled = settled + 1 if step > 0.0 and abs(before - here.energy) <= _NOTHING * here.size else 0
        logger.debug("%s", row)
        limits.widen(here.positions)
        if last:
            if step == 0.0 or is_converged(problem, found.length, here, tools, found.touching):
                return Outcome(Status.CONVERGED, here, "", rows)
            here = objective.model(here.positions, hessian, policy.now)
        elif found.touching and settled >= _SETTLED and _is_balanced(problem, here, tools):
            return Outcome(Status.CONVERGED, here, "", rows)
        elif found.touching and step >= 1.0 and (share := _share_when_outdated(problem, here, tools)) is not None:
            return Outcome(Status.CONVERGED, here, "", rows, share)
        if step == 0.0:
            text = (
                f"no step along Newton's direction ({found.length:.2e} m) lowers the energy, in iteration {iteration}"
            )
            return Outcome(Status.LINE_SEARCH_FAILED, here, text, rows)
        last_length = found.length
    text = (
        f"Newton's method took {problem.max_iterations} iterations; "
        f"its last step was {rows[-1].direction:.2e} m, the tolerance is {convergence.step:.2e} m; "
        f"forces of {free_norm(here.gradient, tools):.2e} N remain"
    )
    return Outcome(Status.ITERATION_LIMIT, here, text, rows)


def _share_when_outdated(problem: Problem, here: Model, tools: Tools) -> float | None:
    """The unbalanced share where the objective is due for a change before its minimum is reached."""
    if problem.outdated is None:
        return None
    contact = free_norm(problem.objective.contact_gradient(here.positions), tools)
    left = free_norm(here.gradient, tools)
    outdated = contact > 0.0 and left <= _NEARLY * contact and problem.outdated(here.positions, left / contact)
    return left / contact if outdated else None


def _is_balanced(problem: Problem, here: Model, tools: Tools) -> bool:
    contact = free_norm(problem.objective.contact_gradient(here.positions), tools)
    return free_norm(here.gradient, tools) <= problem.convergence.force * contact


def is_converged(problem: Problem, length: float, here: Model, tools: Tools, touching: bool) -> bool:
    """Whether `here` is the minimum, after a whole step along a direction of this length; see `Convergence`."""
    contact = None
    if touching:
        contact = free_norm(problem.objective.contact_gradient(here.positions), tools)
    extent = float(np.abs(here.positions).max(initial=0.0))
    return problem.convergence.is_reached(length, extent, free_norm(here.gradient, tools), contact)


def free_norm(gradient: NDArray[np.float64], tools: Tools) -> float:
    """Of a gradient (n, 3) by the free vertices."""
    return norm(tools.freed(gradient))
