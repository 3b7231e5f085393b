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

from supple.model.loads.actuators.laws import Held
from supple.model.state import State
from supple.numerics.inner_product import norm
from supple.solvers.implicit.contact.collisions import Barrier
from supple.solvers.implicit.contact.friction import Friction
from supple.solvers.implicit.contact.lagged import LaggedFriction
from supple.solvers.implicit.energies.joints import JointPotential
from supple.solvers.implicit.energies.loads.actuators import ActuatorPotential
from supple.solvers.implicit.newton.objective import Objective
from supple.solvers.implicit.stepping.contact_step import ContactStep
from supple.solvers.implicit.stepping.integrators import Plan
from supple.solvers.implicit.stepping.substep import Posed, StepSettings, Substep, pose
from supple.solvers.implicit.stepping.workspace import Workspace


@dataclass(frozen=True, eq=False)
class Kept:
    """One substep.

    Attributes
    ----------
    before : where it begins; x : (n, 3) positions at its end, obstacles' vertices included [m]
    end, h : its time and length [s]
    first : whether it is the first one of its step
    met : positions at which contacts got their weights
    stiffening : how often the barrier became stiffer
    at_end : whether friction has the normal forces of the end, and not those of the beginning
    multipliers : of the joints' differences and laws, or None
    held : multipliers of actuators with a given coordinate
    slips_from : (n, 3) where friction's displacements begin, None: where the substep does
    """

    before: State
    x: NDArray[np.float64]
    end: float
    h: float
    first: bool
    settings: StepSettings
    met: tuple[NDArray[np.float64], ...]
    stiffening: int
    at_end: bool
    multipliers: tuple[NDArray[np.float64], NDArray[np.float64]] | None
    held: tuple[float, ...]
    slips_from: NDArray[np.float64] | None = None

    @classmethod
    def of(cls, taken: tuple[State, Substep, float], first: bool) -> Kept:
        """Of what a workspace's tape has."""
        before, substep, h = taken
        assert substep.settings is not None
        contact, joints = substep.contact, substep.joints
        updates = contact.stiffness_increases + contact.friction_updates + (0 if joints is None else joints.updates)
        terms = contact.objective.terms
        laws = (term.law for term in terms if isinstance(term, ActuatorPotential))
        joined = None if joints is None else (joints.potential.multipliers, joints.potential.law_multipliers)
        met = () if contact.model is None else tuple(contact.model.collisions.met)
        return cls(
            before=before,
            x=substep.outcome.end.positions,
            end=substep.state.time,
            h=h,
            first=first,
            settings=substep.settings,
            met=met,
            stiffening=contact.stiffness_increases,
            at_end=updates > 0,
            multipliers=joined,
            held=tuple(law.multiplier for law in laws if isinstance(law, Held)),
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
            barrier = Barrier(model.collisions, ContactStep.stiffened(posed.contact.stiffness, kept.stiffening))
            lag = x if kept.at_end else before.positions
            begun = before.positions if kept.slips_from is None else kept.slips_from
            if not kept.at_end:  # before contacts keep weights
                frictions = tuple(model.frictions(barrier, lag, begun, kept.h))
            for there in kept.met:
                model.collisions.keep_weights(there)
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
    def plan(self) -> Plan:
        return self.posed.plan

    @cached_property
    def gradient(self) -> NDArray[np.float64]:
        """(n, 3) g of all vertices, those of pins and welds included [N]."""
        return self.objective.gradient(self.x)

    @property
    def contact_gradient(self) -> NDArray[np.float64]:
        """(n, 3) of the barrier [N]."""
        return Objective([term for term in self.objective.terms if isinstance(term, Barrier)]).gradient(self.x)

    def area_change(self) -> float:
        """How much contact's forces (n, 3) would change with the areas that contacts have at the end, as a share.

        Afterwards, contacts have those.
        """
        model, kept = self.workspace.contact, self.contact_gradient
        if model is None or not len(model.collisions.at(self.x).kinds):
            return 0.0
        model.collisions.forget_weights()
        change = norm(self.contact_gradient - kept)
        return change / max(norm(kept), np.finfo(float).tiny)

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
