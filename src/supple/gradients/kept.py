"""A substep of a run as it is kept for its derivative, and its equations at the states that it went through.

The end x of a converged substep solves g(x; s, p) = 0, with the state s where it begins and the parameters p in the
scene. With s and x as they are kept, and with a scene of other parameters, `Replay` gives g: nothing is solved.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.contact.candidates import Latest
from supple.model.loads.actuators.laws import Held
from supple.model.state import State
from supple.solvers.implicit.contact.areas import area_derivatives
from supple.solvers.implicit.contact.collisions import Barrier
from supple.solvers.implicit.contact.friction import Friction
from supple.solvers.implicit.contact.lagged import LaggedFriction
from supple.solvers.implicit.energies.joints import JointPotential
from supple.solvers.implicit.newton.minimize import free_norm
from supple.solvers.implicit.newton.objective import Objective
from supple.solvers.implicit.stepping.contact_step import ContactStep
from supple.solvers.implicit.stepping.integrators import Plan
from supple.solvers.implicit.stepping.substep import Ending, Posed, StepSettings, pose
from supple.solvers.implicit.stepping.workspace import Workspace


@dataclass(frozen=True, eq=False)
class Kept:
    """One substep.

    Attributes
    ----------
    before : where it begins; x : (n, 3) positions at its end, obstacles' vertices included [m]
    end, h : its time and length [s]
    first : whether it is the first one of its step
    stiffening : how often the barrier became stiffer
    at_end : whether friction has the normal forces of the end, and not those of the beginning
    multipliers : of the joints' differences and laws, or None
    held : multipliers of actuators with a given coordinate
    slips_from : (n, 3) where friction's displacements begin, None: where the substep does
    near : what is near what at the end, if it is known
    """

    before: State
    x: NDArray[np.float64]
    end: float
    h: float
    first: bool
    settings: StepSettings
    stiffening: int
    at_end: bool
    multipliers: tuple[NDArray[np.float64], NDArray[np.float64]] | None
    held: tuple[float, ...]
    slips_from: NDArray[np.float64] | None = None
    near: Latest | None = None

    @classmethod
    def of(cls, ending: Ending, first: bool) -> Kept:
        contact, joints = ending.contact, ending.joints
        updates = contact.stiffness_increases + contact.friction_updates + (0 if joints is None else joints.updates)
        joined = None if joints is None else (joints.potential.multipliers, joints.potential.law_multipliers)
        return cls(
            before=ending.before,
            x=ending.outcome.end.positions,
            end=ending.end,
            h=ending.h,
            first=first,
            settings=ending.settings,
            stiffening=contact.stiffness_increases,
            at_end=updates > 0 or (contact.model is not None and contact.model.friction_iterations != 1),
            multipliers=joined,
            held=tuple(law.multiplier for law in ending.held),
        )


@dataclass(frozen=True, eq=False)
class Replay:
    """The equations of a kept substep in a workspace, at positions x (n, 3) of its end.

    Attributes
    ----------
    frictions : of the objective; lags : their dependence on where normal forces are taken
    """

    kept: Kept
    workspace: Workspace
    posed: Posed
    x: NDArray[np.float64]
    objective: Objective
    joints: JointPotential | None
    frictions: tuple[Friction, ...]
    lags: tuple[LaggedFriction, ...]

    @classmethod
    def of(cls, kept: Kept, workspace: Workspace) -> Replay:
        """With pins where the workspace's scene has them at the end, and welded vertices on their bodies."""
        before = replace(kept.before, velocities=kept.before.velocities.copy())
        posed = pose(before, kept.end, kept.h, kept.settings, workspace)
        x = kept.x.copy()
        x[workspace.system.pinned_vertices] = posed.targets
        workspace.system.welding.follow(x)
        held = iter(kept.held)
        for actuator in posed.actuators:
            if isinstance(actuator.law, Held):
                actuator.law.multiplier = next(held)
            if actuator.eyelets is not None:
                actuator.renew(x, np.zeros_like(x))
        terms: list[Any] = [*posed.base.terms]
        joints = None
        if posed.joints is not None and kept.multipliers is not None:
            own, laws = kept.multipliers
            begun = posed.joints.potential
            laws = np.where(begun.laws.table["adapts"], laws, begun.law_multipliers)
            joints = replace(begun, multipliers=own, law_multipliers=laws)
            terms.append(joints)
        frictions, lags = (), ()
        model = workspace.contact
        if model is not None:
            if kept.near is not None:
                model.collisions.finder.resume(kept.near)
            barrier = Barrier(model.collisions, ContactStep.stiffened(posed.contact.stiffness, kept.stiffening))
            lag = x if kept.at_end else before.positions
            begun = before.positions if kept.slips_from is None else kept.slips_from
            if not kept.at_end:  # before contacts keep weights
                frictions = tuple(model.frictions(barrier, lag, begun, kept.h))
            model.collisions.settle_weights(x)
            if kept.at_end:
                frictions = tuple(model.frictions(barrier, lag, begun, kept.h))
            lags = tuple(LaggedFriction.of(one, lag, begun) for one in frictions)
            terms += [barrier, *frictions]
        return cls(kept, workspace, posed, x, Objective(terms), joints, frictions, lags)

    @cached_property
    def contact(self) -> Objective:
        """The barrier and friction alone."""
        return Objective([term for term in self.objective.terms if isinstance(term, Barrier | Friction)])

    @property
    def searched(self) -> Kept:
        """The substep, with what is near what at its end."""
        model = self.workspace.contact
        return self.kept if model is None else replace(self.kept, near=model.collisions.finder.latest)

    @property
    def plan(self) -> Plan:
        return self.posed.plan

    @cached_property
    def gradient(self) -> NDArray[np.float64]:
        """(n, 3) g of all vertices, those of pins and welds included [N]."""
        return self.objective.gradient(self.x)

    @property
    def barrier(self) -> Barrier | None:
        return next((term for term in self.objective.terms if isinstance(term, Barrier)), None)

    def lag_from_begin(self, lag: LaggedFriction) -> Any:
        """(3 n, 3 n) the derivative of friction by positions where the step begins, with the areas there."""
        model, there = self.workspace.contact, self.kept.before.positions
        assert model is not None
        model.collisions.settle_weights(there)
        weights, areas = model.collisions.at(there).weights, area_derivatives(model.collisions, there)
        model.collisions.settle_weights(self.x)
        return lag.derivative(self.x, weights, areas)

    @property
    def unbalanced(self) -> float:
        """The norm of the forces that are left on free vertices [N]."""
        return free_norm(self.gradient, self.workspace.tools)

    @property
    def contact_force(self) -> float:
        """The norm of contact's forces on free vertices [N]."""
        return free_norm(self.objective.contact_gradient(self.x), self.workspace.tools)

    def imbalance(self) -> float:
        """The forces that are left, as a share of contact's; 0 where nothing touches.

        They are where areas of contacts or normal forces of friction were not those of the end.
        """
        of_contact = self.contact_force
        return self.unbalanced / of_contact if of_contact else 0.0

    def conditions(self, held: NDArray[np.int64]) -> NDArray[np.float64]:
        """The values that are zero at the end, of actuators with a given coordinate and of joints.

        held : (l,) numbers of the laws of joints that are conditions
        """
        values = [
            np.array([one.coordinate.value(self.x[one.coordinate.vertices]) - one.law.target])
            for one in self.posed.actuators
            if isinstance(one.law, Held)
        ]
        if self.joints is not None:
            values.append(self.joints.differences(self.x).ravel())
            laws = self.joints.laws.table[held]
            values.append(self.joints.coordinates(self.x)[laws["function"]] - laws["start"])
        return np.concatenate([np.zeros(0), *values])
