"""The end of a step where contact has the areas, and friction the normal forces, that belong to that end.

A minimization keeps the areas of contacts that its search met, and friction has the normal forces of the latest update:
both depend on the way of Newton's method, which has no derivative. From its minimum, Newton's method for the equations

    T^T g(x; areas and normal forces at x) = 0,    c(x) = 0

leads to an end that depends on the beginning of the step and the parameters alone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from supple.gradients.equations import Equations
from supple.gradients.kept import Kept, Replay
from supple.solvers.implicit.newton.hessian_projection import ProjectedTerms
from supple.solvers.implicit.newton.minimize import Outcome
from supple.solvers.implicit.newton.objective import Objective
from supple.solvers.implicit.stepping.substep import Ending
from supple.solvers.implicit.stepping.workspace import Workspace

Floats = NDArray[np.float64]

# Of contact's forces: what may be left. Newton's method is quadratic, but where it meets kinks of areas.
_LEFT = 1e-9
_MOST, _MOST_CUTS = 60, 14
# A step has to take this share of itself from what is left.
_DECREASE = 0.01


def settle(ending: Ending, workspace: Workspace) -> Outcome:
    """The outcome of a substep whose contact belongs to its end; `ending` gets that contact."""
    contact, model = ending.contact, ending.contact.model
    if model is None or not model.count(ending.outcome.end.positions):
        return ending.outcome
    kept = Kept.of(ending, first=False)
    if not (model.collisions.has_areas or (kept.at_end and model.coefficients.any())):
        return ending.outcome
    replay = Replay.of(kept, workspace)
    left, enough = replay.unbalanced, _LEFT * replay.contact_force
    for _ in range(_MOST):
        if left <= enough:
            break
        further = _further(replay, left)
        if further is None:
            replay = Replay.of(replay.kept, workspace)  # contacts have its areas again
            break
        replay, left = further
    kept = replay.kept
    contact.objective = Objective(replay.objective.terms, contact.objective.clock)
    contact.barrier, contact.frictions = replay.barrier, list(replay.frictions)
    if ending.joints is not None and replay.joints is not None:
        ending.joints.potential = replay.joints
    for actuator, value in zip(ending.held, kept.held, strict=True):
        actuator.multiplier = value
    return replace(ending.outcome, end=contact.objective.model(kept.x, None, ProjectedTerms.NONE))


def _further(replay: Replay, left: float) -> tuple[Replay, float] | None:
    """One step of Newton's method, cut until less is left, and what is left; None where no cut suffices."""
    equations, kept, workspace = Equations.of(replay), replay.kept, replay.workspace
    values = replay.conditions(equations.held)[equations.rows]
    way, multipliers = equations.newton_step(replay.gradient, values)
    share = replay.posed.limits(workspace).largest_step(kept.x, way).step
    for _ in range(_MOST_CUTS):
        there = Replay.of(_moved(kept, equations, share, way, multipliers), workspace)
        now = there.unbalanced
        if now <= (1.0 - _DECREASE * share) * left:
            return there, now
        share *= 0.5
    return None


def _moved(kept: Kept, equations: Equations, share: float, way: Floats, multipliers: Floats) -> Kept:
    change = np.zeros(equations.count)
    change[equations.rows] = share * multipliers
    of_actuators, rest = np.split(change, [len(kept.held)])
    held = tuple(np.subtract(kept.held, of_actuators).tolist())
    joined = kept.multipliers
    if joined is not None:
        own, laws = joined[0], joined[1].copy()
        laws[equations.held] += rest[own.size :]
        joined = own + rest[: own.size].reshape(own.shape), laws
    return replace(kept, x=kept.x + share * way, held=held, multipliers=joined)
