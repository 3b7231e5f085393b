"""Contact within one step: its terms of the objective, and whether they have to be updated before the step is done."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from supple.model.state import ContactPoints, Status
from supple.numerics.inner_product import norm
from supple.solvers.implicit.contact.collisions import Barrier
from supple.solvers.implicit.contact.friction import Friction
from supple.solvers.implicit.contact.model import ContactModel
from supple.solvers.implicit.contact.points import contact_points, forces_on_owners
from supple.solvers.implicit.details import ImplicitDetails
from supple.solvers.implicit.newton.minimize import Outcome
from supple.solvers.implicit.newton.objective import Objective

FindContacts = Callable[[], ContactPoints] | None

# An adaptive barrier becomes ten times stiffer where surfaces are nearer than this share of dhat, so that distances
# stay far above round-off. Six increases are for bodies up to 1e6 times as stiff as the softest, which sets the scale.
_TOO_NEAR = 1e-2
_STIFFENING = 10.0
_MOST_INCREASES = 6

# Of dhat: below it, the barrier of one linearization is quadratic.
_SOFT = 0.1
# Of dhat: no step goes below this distance, which otherwise falls below round-off in some steps.
_FLOOR = 0.01

# What scripts press together stays together, however stiff the barrier is: an increase has to double the distance.
_LEAST_GAIN = 2.0

# The default of `Contact.friction_iterations`: friction's normal forces are updated while they change by more than this
# share, and at most this often. More updates cost time and change little.
_FORCE_CHANGE = 0.1
_MOST_UPDATES = 5

# Normal forces of a state in which more than this share of contact's forces is not balanced are not those of the end,
# even if they are near: at the end they may differ by this share.
_BALANCED = 3e-3
_EARLY_CHANGE = 0.02


@dataclass(eq=False)
class ContactStep:
    """The contact of one step from `start` (n, 3), between two times [s].

    Attributes
    ----------
    linearized : whether the step is a few linearizations
    objective : the latest one, with contact
    stiffness : of the barrier now [Pa], the integrator's weight included
    stiffness_increases : their number; nearest : the smallest distance before the latest one [m]
    friction_updates : their number; normal_gradient : (n, 3) of the barrier at the latest one [N]
    unbalanced : share of contact's forces that was not balanced there
    """

    model: ContactModel | None
    start: NDArray[np.float64]
    times: tuple[float, float]
    weight: float
    linearized: bool = False
    stiffness: float = field(init=False)
    objective: Objective = field(init=False)
    stiffness_increases: int = 0
    nearest: float = 0.0
    friction_updates: int = 0
    unbalanced: float = 0.0
    barrier: Barrier | None = None
    frictions: list[Friction] | None = None
    normal_gradient: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3)))

    def __post_init__(self) -> None:
        if self.model is not None:
            self.model.collisions.floor = _FLOOR * self.model.scales.dhat if self.linearized else 0.0
            # Weights stay during the step: with those of every minimum in turn, the minima can alternate.
            self.model.collisions.forget_weights()
        self.stiffness = self.model.scales.stiffness * self.weight if self.model is not None else 0.0

    @staticmethod
    def stiffened(stiffness: float, increases: int) -> float:
        """A barrier's stiffness after so many increases."""
        return stiffness * _STIFFENING**increases

    def with_contact(self, objective: Objective, x: NDArray[np.float64]) -> Objective:
        """The objective with the barrier, and with friction whose normal forces are those at x (n, 3)."""
        self.objective = objective
        if self.model is None:
            return objective
        soft = _SOFT * self.model.scales.dhat if self.linearized else 0.0
        self.barrier = Barrier(self.model.collisions, self.stiffness, soft)
        self.frictions = self.model.frictions(self.barrier, x, self.start, self.times[1] - self.times[0])
        if self.model.coefficients.any():
            self.normal_gradient = Objective([self.barrier]).gradient(x)
        self.objective = Objective([*objective.terms, self.barrier, *self.frictions], objective.clock)
        return self.objective

    def needs_update(self, x: NDArray[np.float64], unbalanced: float = 0.0) -> bool:
        """Whether to continue from x (n, 3) with a stiffer barrier or with friction of the normal forces there.

        unbalanced : share of contact's forces that is not balanced
        """
        if self.model is None:
            return False
        scales = self.model.scales
        nearest = self.model.smallest_distance(x)
        increases = self.stiffness_increases
        allowed = increases == 0 or (increases < _MOST_INCREASES and nearest > _LEAST_GAIN * self.nearest)
        allowed = allowed and unbalanced <= _BALANCED
        if scales.adaptive and allowed and nearest < _TOO_NEAR * scales.dhat:
            self.stiffness = self.stiffened(self.stiffness, 1)
            self.stiffness_increases += 1
            self.nearest = nearest
            return True
        if self.friction_is_outdated(x, unbalanced):
            self.friction_updates += 1
            self.unbalanced = unbalanced
            return True
        return False

    def friction_is_outdated(self, x: NDArray[np.float64], unbalanced: float) -> bool:
        """Whether friction has to be updated with the normal forces at x (n, 3); see `needs_update`."""
        if self.model is None or self.barrier is None or not self.model.coefficients.any():
            return False
        wanted = self.model.friction_iterations
        if self.friction_updates + 1 >= (_MOST_UPDATES if wanted is None else wanted):
            return False
        if unbalanced > _BALANCED and (wanted is not None or self.friction_updates):
            return False
        if wanted is not None:
            return True
        now = Objective([self.barrier]).gradient(x)
        change = norm(now - self.normal_gradient)
        early = unbalanced <= _BALANCED < self.unbalanced
        allowed = _EARLY_CHANGE if early else _FORCE_CHANGE
        return change > allowed * norm(now)

    def verified(self, outcome: Outcome) -> Outcome:
        """The outcome, or a failure where things have passed each other, or intersect because of rounding.

        Every state that the next step may start from is tested, whether Newton's method has converged or not.
        """
        if self.model is None or not outcome.status.can_go_on:
            return outcome
        if self.model.collisions.intersect(outcome.end.positions):
            return replace(outcome, status=Status.LINE_SEARCH_FAILED, message="two surfaces intersect after the step")
        names = self.model.passing(self.start, outcome.end.positions)
        if names is None:
            return outcome
        text = f"{names} pass each other within the step; take a shorter one"
        return replace(outcome, status=Status.TUNNELLED, message=text)

    def touching(self, x: NDArray[np.float64]) -> NDArray[np.int32]:
        """The vertices in contact at x (n, 3)."""
        if self.model is None:
            return np.zeros(0, dtype=np.int32)
        return np.unique(self.model.vertices(np.unique(self.model.collisions.at(x).points)))

    def measured(
        self, details: ImplicitDetails, x: NDArray[np.float64]
    ) -> tuple[ImplicitDetails, float | None, FindContacts]:
        """The details of a step that ended at x (n, 3), with what contact does there.

        Returns
        -------
        details, nearest, contacts : the latter two are `min_distance` and `contacts` of `StepReport`.
        """
        model, barrier = self.model, self.barrier
        if model is None or barrier is None:
            return details, None, None
        normal, tangential = (Objective(terms).gradient(x) for terms in ([barrier], self.frictions or ()))
        details = replace(
            details,
            contacts=model.count(x),
            contact_forces=forces_on_owners(model, normal / self.weight),
            friction_forces=forces_on_owners(model, tangential / self.weight),
            contact_stiffness=self.stiffness / self.weight,
            dhat=model.scales.dhat,
        )
        nearest = model.smallest_distance(x)
        nearest = nearest if np.isfinite(nearest) else None
        contacts, frictions = model.collisions.at(x), tuple(self.frictions or ())
        return details, nearest, lambda: contact_points(model, barrier, frictions, x, contacts, self.weight)
