"""Moves pinned vertices to their positions at the end of a step, through states without inverted tets.

Each iteration extends the pins' remaining displacement d_p into the body: with the Hessian H of the objective, free
vertices f and pinned ones p, it solves H_ff d_f = -(gradient_f + H_fp d_p), one Newton step with d_p prescribed. The
step filter limits how much of it is taken. Where it lets next to nothing pass, the extension is that of the
displacement alone: far from equilibrium one Newton step for the forces may lead anywhere. Afterwards Newton's method
continues with the pins in place.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.model.state import Status
from supple.model.system import System
from supple.solvers.implicit.newton.direction import Tools
from supple.solvers.implicit.newton.minimize import Outcome, Problem
from supple.solvers.implicit.newton.trace import NewtonRow
from supple.solvers.implicit.step_limits import StepLimits

# A smaller share of the remaining displacement is not worth an iteration: a shorter time step helps more. Neither are
# more iterations than this.
_SMALLEST_SHARE = 0.02
_MOST_ITERATIONS = 25

# Relative, of the linear solver. The minimization that follows corrects what is left.
_TOLERANCE = 1e-3


def move_pins(
    system: System,
    problem: Problem,
    x: NDArray[np.float64],
    targets: NDArray[np.float64],
    limits: StepLimits,
    tools: Tools,
) -> tuple[NDArray[np.float64], Outcome]:
    """Move the pinned vertices from their positions in x to `targets` (k, 3).

    Returns
    -------
    positions, outcome : `converged` with pins exactly at their targets; `blocked`, with a message that names the pin,
        where the filters do not let them arrive.
    """
    pinned = tools.pinned
    moved_with = np.concatenate([pinned, system.welding.vertices])
    near = np.flatnonzero(np.isin(system.elements, moved_with).any(axis=1))
    nodes = system.elements[near]
    rows: list[NewtonRow] = []
    with_forces = 1.0
    for iteration in range(_MOST_ITERATIONS):
        displacement = np.zeros_like(x)
        displacement[pinned] = targets - x[pinned]
        system.welding.follow(displacement)
        here = problem.objective.model(x, tools.hessian)
        gradient = here.gradient
        with tools.clock.of("linear_solve"):
            tools.linear_solver.assemble(tools.hessian)
        # One row more, for the nodes without a vertex, number -1.
        pull, extended = np.zeros((len(x) + 1, 3)), np.concatenate([displacement, np.zeros((1, 3))])
        moved = np.einsum("eij,ej->ei", tools.hessian.elements[near], extended[nodes].reshape(-1, 12))
        np.add.at(pull, nodes, moved.reshape(-1, 4, 3))
        pull = pull[:-1]
        for coupling in tools.hessian.beyond_elements:
            coupling.add_product(displacement, pull)
        for part in tools.hessian.low_rank:
            part.add_product(displacement, pull)
        with tools.clock.of("linear_solve"):
            direction, report = tools.linear_solver.solve(-tools.freed(with_forces * gradient + pull), _TOLERANCE)
        if direction is None or not np.isfinite(direction).all():
            text = "the linear system that moves the pins could not be solved"
            return x, Outcome(Status.NOT_FINITE, here, text, rows)
        direction[pinned] = displacement[pinned]
        system.welding.follow(direction)
        step, tet, reason, _ = limits.largest_step(x, direction)
        rows.append(
            NewtonRow(
                iteration=iteration,
                energy=float("nan"),
                force=float(np.abs(gradient).max(initial=0.0)),
                direction=float(np.abs(direction).max(initial=0.0)),
                linear_solver=report.method,
                linear_iterations=report.iterations,
                linear_tolerance=_TOLERANCE,
                filter=step,
                step=step,
                cuts=0,
                limit=reason,
                kind="extension",
            )
        )
        end = x + step * direction
        if step == 1.0:
            end[pinned] = targets
            system.welding.follow(end)
        while step > 0.0 and not limits.allows(end):
            step *= 0.5
            end = x + step * direction
        if step < _SMALLEST_SHARE and with_forces:
            with_forces = 0.0
            continue
        if step < _SMALLEST_SHARE:
            return x, Outcome(Status.BLOCKED, here, _blocked_message(system, x, targets, tet, limits), rows)
        x = end
        limits.widen(x)
        if step == 1.0:
            return x, Outcome(Status.CONVERGED, here, "", rows)
    return x, Outcome(Status.BLOCKED, here, _blocked_message(system, x, targets, tet, limits), rows)


def _blocked_message(
    system: System, x: NDArray[np.float64], targets: NDArray[np.float64], tet: int, limits: StepLimits
) -> str:
    """Which pin is blocked: one that holds a node of the limiting tet, otherwise the one farthest from its target."""
    remaining = np.linalg.norm(targets - x[system.pinned_vertices], axis=1)
    best, rank, first = None, (False, -1.0), 0
    for pin in system.pins:
        left = float(remaining[first : first + len(pin.vertices)].max())
        first += len(pin.vertices)
        limits_it = tet >= 0 and left > 0.0 and bool(np.isin(system.tets[tet], pin.vertices).any())
        if (limits_it, left) > rank:
            best, rank = pin, (limits_it, left)
    assert best is not None
    if tet < 0 and limits.contact is not None:
        return f"{best.label} is blocked: any farther, it would press {limits.contact.nearest(x)} into each other"
    return f"{best.label} is blocked: any farther, it would invert {limits.guard.name(tet)}"
