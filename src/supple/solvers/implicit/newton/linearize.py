"""One linearization a step, for real time: Newton's method stops before its tolerance, and says so.

The Hessian is the true one of all but contact; only where that is indefinite, it is projected. What the direction would
run into becomes rows of its linear system, which is solved again: otherwise the first collision would shorten the step,
and stop the motion (time-of-impact locking). The filters are those of the whole method, so that tets stay positive and
surfaces apart. Bodies that do not touch each other are shortened on their own. What is not balanced is reported.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from supple.model.state import Status
from supple.numerics.inner_product import inner
from supple.solvers.implicit.contact.approach import Approach
from supple.solvers.implicit.contact.collisions import Barrier
from supple.solvers.implicit.contact.friction import Friction
from supple.solvers.implicit.contact.sliding import Sliding
from supple.solvers.implicit.newton.direction import Direction, DirectionFinder, Tools, newton_row
from supple.solvers.implicit.newton.hessian_projection import ProjectedTerms, ProjectionPolicy
from supple.solvers.implicit.newton.line_search import Jumps, search
from supple.solvers.implicit.newton.minimize import Outcome, Problem, free_norm, is_converged
from supple.solvers.implicit.newton.objective import Model
from supple.solvers.implicit.newton.trace import NewtonRow
from supple.solvers.implicit.step_limits import StepLimits

# Up to this many iterations are linearizations. A step that is cut takes all of them.
FEW = 3

# Linear systems of one linearization: the first, and those that are solved again with what a direction runs into.
_MOST_SYSTEMS = 3
# Of the matrix's usual diagonal: as stiff as rows may be with this tolerance of conjugate gradients.
_ROW_STIFFNESS = 100.0
_ROW_TOLERANCE = 1e-3

# A step that filters or energy make shorter than this is linearized again.
_LEAST_STEP = 0.5


def linearize(problem: Problem, x: NDArray[np.float64], limits: StepLimits, tools: Tools) -> Outcome:
    """Take `max_iterations` Newton steps from x, and up to `FEW` after cuts; see `minimize`."""
    hessian = tools.hessian
    objective = problem.objective if problem.renewed is None else problem.renewed(x)
    policy = ProjectionPolicy(ProjectedTerms.RELEASED_LAST)
    directions = DirectionFinder(objective, tools, problem.scale, 0.0, problem.longest, policy=policy)
    here, jumps = objective.model(x, hessian, policy.now), Jumps()
    barrier = next((term for term in objective.terms if isinstance(term, Barrier)), None)
    approach = None if barrier is None else Approach.of(barrier.collisions, _row_stiffness(tools))
    rows: list[NewtonRow] = []
    if not np.isfinite(here.energy):
        return Outcome(Status.NOT_FINITE, here, "the energy at the start of Newton's method is not finite", rows)
    last_system = tools.linear_solver.solves + _MOST_SYSTEMS * problem.max_iterations
    for iteration in tools.linear_solver.iterations(FEW):
        solved = _direction(directions, here, approach, last_system)
        if solved is None:
            return Outcome(Status.NOT_FINITE, here, "the linear system of a Newton step could not be solved", rows)
        here, found = solved
        way, limit = limits.shortened(here.positions, found.vector)
        slope = found.slope if limit.step == 1.0 else inner(tools.freed(here.gradient), way)
        end, step, cuts = search(objective, here, way, slope, 1.0, limits, jumps)
        if step == 0.0 and limit.step < 1.0:
            # Parts of a direction need not lead down.
            end, step, cuts = search(objective, here, found.vector, found.slope, limit.step, limits, jumps)
        objective.renew(here.positions, found.vector)
        whole = min(limit.step, step) >= _LEAST_STEP
        last = problem.convergence.is_short(found.length) or step == 0.0
        last = last or (whole and iteration + 1 >= problem.max_iterations) or iteration + 1 == FEW
        last = last or tools.linear_solver.solves >= last_system
        if not last and problem.renewed is not None:
            objective = directions.objective = problem.renewed(end)
        here = objective.model(end, None if last else hessian, policy.now)
        rows.append(newton_row(iteration, here.energy, found, (limit.step, step, cuts), limit.reason))
        limits.widen(here.positions)
        if last:
            break
    exact = barrier is None or barrier.collisions.smallest_distance(here.positions) >= barrier.soft
    if exact and is_converged(replace(problem, objective=objective), found.length, here, tools, found.touching):
        return Outcome(Status.CONVERGED, here, "", rows)
    text = (
        f"{len(rows)} linearization{'s' * (len(rows) > 1)}; the last step was {found.length:.2e} m, converged is "
        f"{problem.convergence.step:.2e} m; forces of {free_norm(here.gradient, tools):.2e} N are not balanced"
    )
    return Outcome(Status.LINEARIZED, here, text, rows)


def _row_stiffness(tools: Tools) -> float:
    return _ROW_STIFFNESS * float(np.median(tools.hessian.elements[:, 0, 0]))


def _direction(
    directions: DirectionFinder, here: Model, approach: Approach | None, last_system: int
) -> tuple[Model, Direction] | None:
    """A direction from a point, and the objective there: with rows for what it would run into, so that contact does not
    cut it, and with no more friction than Coulomb's law allows.

    last_system : the number of the system that is not solved again
    """
    solver = directions.tools.linear_solver
    last_system = min(last_system, solver.solves + _MOST_SYSTEMS)
    found, objective = directions.find(here), directions.objective
    couplings = directions.tools.hessian.couplings
    known, x = len(couplings), here.positions
    sliding = [Sliding.of(term) for term in objective.terms if isinstance(term, Friction)]
    while found is not None and solver.solves < last_system:
        more = [each.with_more(x, found.vector) for each in sliding]
        again = any(each is not None for each in more)
        sliding = [each or old for each, old in zip(more, sliding, strict=True)]
        if approach is not None and (pushing := approach.with_more(x, found.vector)) is not None:
            approach = pushing
            again = again or len(approach.rows.kinds) > 0
        if not again:
            break
        corrections = [*sliding, *([] if approach is None else [approach])]
        del couplings[known:]
        gradient = here.gradient.copy()
        for each in corrections:
            each.add_hessian(x, directions.tools.hessian, True)
            each.add_gradient(x, gradient)
        directions.objective = replace(objective, terms=[*objective.terms, *corrections])
        directions.forcing = _ROW_TOLERANCE
        found = directions.find(replace(here, gradient=gradient))
    directions.objective = objective
    if found is None:
        return None
    here = _balanced(here, sliding, found.vector)
    gradient = directions.tools.freed(here.gradient)
    return here, replace(found, slope=inner(gradient, found.vector))


def _balanced(here: Model, sliding: list[Sliding], way: NDArray[np.float64]) -> Model:
    """The objective at a point, with the friction of the normal forces that are predicted for a way (n, 3) from it."""
    energy, gradient = here.energy, here.gradient.copy()
    for each in sliding:
        before, part = each.friction, np.zeros_like(gradient)
        energy -= before.value(here.positions)
        before.add_gradient(here.positions, part)
        gradient -= part
        each.renew(way)
        energy += before.value(here.positions)
        before.add_gradient(here.positions, gradient)
    return replace(here, energy=energy, gradient=gradient)
