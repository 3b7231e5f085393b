"""One substep backwards: from the derivatives of a loss by the state at its end to those by the state at its beginning.

With the equations of `supple.gradients.equations`, the adjoint forces l = T l_y + (seeds at pins) and u solve

    [ T^T K T  T^T C^T ]^T [ l_y ]     [ T^T (dL/dx + K^T l_pins) ]
    [ C T      0       ]   [ u   ] = - [ C l_pins                 ]

Then dL/dp = l . dg/dp + u . dc/dp + dL/dx . dx/dp at fixed y and s, and likewise by s.

Source: Johnson, "Notes on Adjoint Methods for 18.335" (2012); Geilinger et al., "ADD: Analytically Differentiable
Dynamics for Multi-Body Systems with Frictional Contact" (2020).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from supple.gradients.begun import add_by_joints, add_by_loads
from supple.gradients.equations import Equations
from supple.gradients.flow import add_by_end, by_begin
from supple.gradients.kept import Replay
from supple.solvers.implicit.energies.damping import StrainRate
from supple.solvers.implicit.stepping.integrators import History

Floats = NDArray[np.float64]

# Of the extent of the bodies: the step of a difference of strains, which are quadratic but for those of springs.
_STRAIN_STEP = 1e-4


@dataclass(eq=False)
class StateAdjoint:
    """Derivatives of a loss by a state, (n, 3) each: by its positions and velocities, and by those that BDF2 remembers;
    and by internal variables (k, 11)."""

    x: Floats
    v: Floats
    past_x: Floats
    past_v: Floats
    internal: Floats

    @classmethod
    def zeros(cls, n: int, internal: int) -> StateAdjoint:
        x, v, past_x, past_v = np.zeros((4, n, 3))
        return cls(x, v, past_x, past_v, np.zeros((internal, 11)))

    def with_vertices(self, n: int) -> StateAdjoint:
        """With n vertices: further ones have zeros."""
        parts = (self.x, self.v, self.past_x, self.past_v)
        x, v, past_x, past_v = (np.concatenate([one[:n], np.zeros((max(0, n - len(one)), 3))]) for one in parts)
        return StateAdjoint(x, v, past_x, past_v, self.internal)


def no_derivatives(n: int) -> Floats:
    """(n, 3) zeros that take no memory."""
    return np.broadcast_to(0.0, (n, 3))


@dataclass(eq=False)
class ForceAdjoint:
    """Derivatives of a loss by forces at the end of a step: at pinned vertices (n, 3), of contact (n, 3), whose minus
    act on bodies [1/N]; and by those of actuators with a given coordinate (h,)."""

    pins: Floats
    contact: Floats
    held: Floats

    @classmethod
    def zeros(cls, n: int, held: int) -> ForceAdjoint:
        """Of arrays that take no memory, and are not written to."""
        return cls(no_derivatives(n), no_derivatives(n), np.zeros(held))


@dataclass(frozen=True, eq=False)
class StepAdjoint:
    """What the parameters' derivatives need of one substep.

    Attributes
    ----------
    forces : (n, 3) l
    multipliers : (c,) u, of the conditions `rows` among all; held : (l,) which laws of joints are conditions
    end : (n, 3) dL/dx; begin : (n, 3) derivative by the positions where it begins
    internal : (k, 11) by the internal variables at the end; anchors : (a, 3) by where pins are then
    contact : (n, 3) by forces of contact, as in `ForceAdjoint`
    """

    forces: Floats
    multipliers: Floats
    rows: NDArray[np.int64]
    held: NDArray[np.int64]
    end: Floats
    begin: Floats
    internal: Floats
    anchors: Floats
    contact: Floats

    def value(self, replay: Replay) -> float:
        """A function of the scene alone, whose derivative by the parameters is that of the loss in this substep."""
        forces, system = self.forces.copy(), replay.workspace.system
        system.welding.follow(forces)
        total = np.einsum("ij,ij->", forces, replay.gradient) + np.einsum("ij,ij->", self.end, replay.x)
        if self.contact.any():
            total += np.einsum("ij,ij->", self.contact, replay.contact.gradient(replay.x))
        if len(self.rows):
            total += self.multipliers @ replay.conditions(self.held)[self.rows]
        if len(self.internal):
            begun = replay.kept.before.internal
            total += np.einsum("ij,ij->", self.internal, replay.posed.grown.flowed(replay.x, begun, replay.kept.h))
        if replay.kept.first:
            # Obstacles' vertices, and points of rigid bodies that something is stitched to, are placed at each step.
            begun = replay.kept.before
            n = len(system.start_states[-1].positions)
            own = replace(begun, positions=begun.positions[:n], velocities=begun.velocities[:n])
            total += np.einsum("ij,ij->", self.begin[n:], replay.workspace.extended(own).positions[n:])
        return float(total)


def step_adjoint(replay: Replay, after: StateAdjoint, by_forces: ForceAdjoint) -> tuple[StepAdjoint, StateAdjoint]:
    """The adjoint of a substep, and that of the state where it begins.

    Parameters
    ----------
    after : of the state at its end
    by_forces : of the forces at its end

    Raises
    ------
    SolverError : where the equations are singular.
    """
    plan = replay.plan
    welding = replay.workspace.system.welding
    seeds = by_forces.pins.copy()
    welding.follow(seeds)
    by_end = after.x.copy()
    rate = 0.0 if plan.scale is None else 1.0 / float(np.sqrt(plan.scale))
    by_end += rate * after.v
    if len(after.internal):
        add_by_end(replay, after.internal, by_end)
    equations = Equations.of(replay)
    contact, by_contact = by_forces.contact, np.zeros_like(by_end)
    if contact.any():
        by_contact = equations.contact_product(contact, transposed=True)
        by_end += by_contact
    right = by_end + equations.transposed_product(seeds)
    forces, multipliers = equations.solve_transposed(-right, seeds, by_forces.held)
    forces += seeds
    welding.follow(forces)
    begin = _by_state(replay, after, forces, contact, rate)
    if len(after.internal):
        begin.internal = by_begin(replay, forces, after.internal)
    add_by_loads(replay, forces, begin.x)
    rows, held = equations.rows, equations.held
    of_conditions = np.zeros(equations.count)
    of_conditions[rows] = multipliers
    add_by_joints(replay, forces, of_conditions, held, begin.x)
    end = after.x + rate * after.v
    whole = end + by_contact + equations.transposed_product(forces) + (equations.C.T @ multipliers).reshape(-1, 3)
    anchors = whole[replay.workspace.system.pinned_vertices]
    return StepAdjoint(forces, multipliers, rows, held, end, begin.x, after.internal, anchors, contact), begin


def _by_state(replay: Replay, after: StateAdjoint, forces: Floats, contact: Floats, rate: float) -> StateAdjoint:
    """What forces (n, 3) on the equations, `contact` (n, 3) on its part alone, and the velocities at the end, give to
    the state at the beginning."""
    plan, x, before = replay.plan, replay.x, replay.kept.before
    out = StateAdjoint.zeros(len(x), 0)
    for lag in replay.lags:
        pushed = lag.friction.by_start(x, forces + contact)
        out.x += pushed
        if not replay.kept.at_end:
            out.x += (replay.lag_from_begin(lag).T @ (forces + contact).ravel()).reshape(-1, 3)
    if plan.scale is None:
        return out
    out.x += after.past_x
    out.v += after.past_v
    one, two = plan.past
    predicted = -replay.workspace.system.masses[:, None] / plan.scale * forces
    by_x, by_v = predicted - rate * after.v, predicted / rate
    out.x += one * by_x
    out.v += one * by_v
    if two:
        out.past_x -= two * by_x
        out.past_v -= two * by_v
    longest = float(np.abs(forces).max(initial=0.0))
    if replay.workspace.dampers and longest > 0.0:
        past = before.memory.positions if two and isinstance(before.memory, History) else None
        step = _STRAIN_STEP * replay.workspace.diagonal / longest
        for damper in replay.workspace.dampers:
            strains = damper.strains
            along = (strains(x + step * forces) - strains(x - step * forces)) / (2.0 * step)
            for there, share, target in ((before.positions, one, out.x), (past, -two, out.past_x)):
                if there is not None:
                    pull = np.zeros_like(x)
                    damper.damping(StrainRate(rate, strains(there) - along)).add_gradient(there, pull)
                    target -= share * pull
    return out
