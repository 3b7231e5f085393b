"""One substep forwards: from the derivatives of the state at its beginning by one parameter to those at its end.

With the equations of `supple.gradients.equations`,

    [ T^T K T  T^T C^T ] [ dy ]     [ T^T (dg/ds ds + dg/dp dp) ]
    [ C T      0       ] [ dm ] = - [ dc/ds ds + dc/dp dp       ]

whose right side is two central differences of the equations at a fixed end: along ds, and in the scenes of p + e and
p - e. One factorization serves all parameters.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from supple.gradients.equations import Equations
from supple.gradients.kept import Kept, Replay
from supple.model.state import State
from supple.solvers.implicit.stepping.integrators import History
from supple.solvers.implicit.stepping.workspace import Workspace

Floats = NDArray[np.float64]

# The step of differences along ds: of the smallest body, and of the distance over which contact acts.
_OF_BODY, _OF_CONTACT = 1e-6, 3e-4


@dataclass(frozen=True, eq=False)
class Side:
    """The scenes on both sides of a parameter: at p + step and p - step, with their starts."""

    step: float
    above: Workspace
    below: Workspace
    start_above: State
    start_below: State

    def difference(self, value: Callable[[Workspace, float], Floats]) -> Floats:
        """Of a function of a workspace and the change of the parameter."""
        return (value(self.above, self.step) - value(self.below, -self.step)) / (2.0 * self.step)


@dataclass(eq=False)
class StateTangent:
    """Derivatives by one parameter, named as in `StateAdjoint`.

    Attributes
    ----------
    pins : (n, 3) forces of pins on vertices [N]
    contact : (n, 3) minus those of contact [N]; zero where they are not asked for
    held : (h,) of actuators with a given coordinate
    """

    x: Floats
    v: Floats
    past_x: Floats
    past_v: Floats
    internal: Floats
    pins: Floats
    contact: Floats
    held: Floats

    @classmethod
    def start(cls, side: Side, at: State) -> StateTangent:
        one, other, e = side.start_above, side.start_below, 2.0 * side.step
        zero = np.zeros_like(at.positions)
        x, v = (one.positions - other.positions) / e, (one.velocities - other.velocities) / e
        return cls(x, v, zero, zero, np.zeros_like(at.internal), zero, zero, np.zeros(0))

    def with_vertices(self, n: int) -> StateTangent:
        """The state at the end of a step, without vertices that only a solver has."""
        return replace(self, x=self.x[:n], v=self.v[:n], pins=self.pins[:n], contact=self.contact[:n])


def step_tangent(
    replay: Replay, equations: Equations, side: Side, at: StateTangent, *, contact: bool = False
) -> StateTangent:
    """The tangent at the end of a substep; contact : whether that of contact's forces is asked for"""
    kept, workspace, plan = replay.kept, replay.workspace, replay.plan
    if kept.first:
        at = _extended(at, kept, side)

    def equations_at(place: Workspace, changed: Kept) -> Floats:
        there = Replay.of(changed, place)
        of_conditions = there.conditions(equations.held)[equations.rows]
        of_contact = there.contact.gradient(there.x).ravel() if contact else np.zeros(0)
        return np.concatenate([there.gradient.ravel(), of_conditions, of_contact, there.x.ravel()])

    size = kept.x.size
    c = len(equations.rows)
    more = size if contact else 0
    by_scene = side.difference(lambda place, _: equations_at(place, kept))
    pins = by_scene[size + c + more :].reshape(-1, 3)
    by_state = np.zeros(size + c + more)
    e = _step_along(kept, workspace, at)
    if e:
        above, below = (equations_at(workspace, _moved(kept, at, sign * e)) for sign in (1.0, -1.0))
        by_state = ((above - below) / (2.0 * e))[: size + c + more]
        for friction in replay.frictions:
            by_start = friction.by_start(replay.x, at.x).ravel()
            by_state[:size] += by_start
            by_state[size + c :] += by_start[:more]
    right = -(by_scene[: size + c + more] + by_state)
    own, of_multipliers, multipliers = equations.solve(right[:size].reshape(-1, 3), right[size : size + c])
    way = own + pins
    of_contact = np.zeros_like(way)
    if contact:
        # Where pins are is a part of the scene, with which the gradient was differentiated.
        of_contact = equations.contact_product(own) - right[size + c :].reshape(-1, 3)
    held = np.zeros(equations.count)
    held[equations.rows] = -multipliers
    change = equations.product(own) + of_multipliers - right[:size].reshape(-1, 3)
    rate = 0.0 if plan.scale is None else 1.0 / float(np.sqrt(plan.scale))
    one, two = plan.past
    v = rate * (way - one * at.x + two * at.past_x) if two else rate * (way - one * at.x)
    internal = at.internal
    if len(internal):
        begun, time = kept.before.internal, replay.posed.middle

        def flowed(place: Workspace, e: float) -> Floats:
            return place.elasticity_at(time).flowed(kept.x + e * way, begun + e * at.internal, kept.h)

        internal = side.difference(flowed)
    return StateTangent(
        way, v, at.x, at.v, internal, workspace.system.welding.reduced(change), of_contact, held[: len(kept.held)]
    )


def _extended(at: StateTangent, kept: Kept, side: Side) -> StateTangent:
    """With the vertices that each step begins with: of obstacles, and of what is stitched to rigid bodies."""
    begun, n = kept.before, len(at.x)

    def placed(place: Workspace, e: float) -> Floats:
        own = replace(begun, positions=begun.positions[:n] + e * at.x, velocities=begun.velocities[:n] + e * at.v)
        whole = place.extended(own)
        return np.stack([whole.positions, whole.velocities])

    x, v = side.difference(placed)
    return replace(at, x=x, v=v)


def _moved(kept: Kept, at: StateTangent, e: float) -> Kept:
    """The substep from a state that is e times the tangent away."""
    before, memory = kept.before, kept.before.memory
    if isinstance(memory, History) and memory.positions.shape == at.past_x.shape:
        x, v = memory.positions + e * at.past_x, memory.velocities + e * at.past_v
        memory = replace(memory, positions=x, velocities=v)
    x = before.positions + e * at.x
    internal = before.internal + e * at.internal
    begun = replace(before, positions=x, velocities=before.velocities + e * at.v, memory=memory, internal=internal)
    # What sticks moves with the start of its slip: the difference of both is found in closed form.
    return replace(kept, before=begun, slips_from=before.positions)


def _step_along(kept: Kept, workspace: Workspace, at: StateTangent) -> float:
    """e such that no vertex moves far along e times the tangent; 0 where nothing changes."""
    moves = (at.x, kept.h * at.v, at.past_x, kept.h * at.past_v)
    fastest = max(float(np.abs(change).max(initial=0.0)) for change in moves)
    most = _OF_BODY * workspace.diagonal
    if workspace.contact is not None:
        most = min(most, _OF_CONTACT * workspace.contact.scales.dhat)
    flows = float(np.abs(at.internal).max(initial=0.0))
    steps = [most / fastest] if fastest else []
    steps += [_OF_BODY / flows] if flows else []
    return min(steps, default=0.0)
