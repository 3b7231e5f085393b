"""Contact within one step: its terms of the objective, and whether they have to be refined before the step is done."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from supple.implicit.contact.friction import Friction
from supple.implicit.contact.half_spaces import PlaneFriction
from supple.implicit.contact.model import Barriers, ContactModel
from supple.implicit.contact.points import contact_points, forces_on_owners
from supple.implicit.newton.minimize import Outcome
from supple.implicit.newton.objective import Objective
from supple.state import Status, StepReport

# Surfaces nearer than this share of dhat: an adaptive barrier becomes stiffer.
_TOO_NEAR = 1e-2
_STIFFER = 10.0
_MOST_RAISES = 6
_HELPS = 2.0

# Friction is brought up to date while normal forces change by more than this share, and so often at most.
_PRESSED_DIFFERENTLY = 0.1
_MOST_LAGS = 5


@dataclass(eq=False)
class ContactStep:
    """The contact of one step from `start` (n, 3), between two times [s].

    Attributes
    ----------
    stiffness : of the barrier now [Pa], the integrator's weight included
    raises : how often it was raised; nearest : the smallest distance before the latest raise [m]
    lagged : how often friction has been brought up to date; pressing : (n, 3) the barriers' gradient that it knows [N]
    """

    model: ContactModel | None
    start: NDArray[np.float64]
    times: tuple[float, float]
    weight: float
    stiffness: float = 0.0
    raises: int = 0
    nearest: float = 0.0
    lagged: int = 0
    barriers: Barriers | None = None
    frictions: list[Friction | PlaneFriction] | None = None
    pressing: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3)))

    @classmethod
    def of(
        cls, model: ContactModel | None, start: NDArray[np.float64], times: tuple[float, float], weight: float
    ) -> ContactStep:
        return cls(model, start, times, weight, model.scales.stiffness * weight if model is not None else 0.0)

    def added_to(self, objective: Objective, x: NDArray[np.float64]) -> Objective:
        """The objective with barriers, and with friction whose normal forces are those at x (n, 3)."""
        if self.model is None:
            return objective
        self.barriers = self.model.barriers(self.stiffness)
        self.frictions = self.model.frictions(self.barriers, x, self.start, self.times)
        if self.model.coefficients.any():
            self.pressing = Objective(self.barriers.terms).gradient(x)
        return Objective([*objective.terms, *self.barriers.terms, *self.frictions], objective.clock)

    def refine(self, x: NDArray[np.float64]) -> bool:
        """Whether the step has to go on from x with a stiffer barrier or newer normal forces of friction."""
        if self.model is None:
            return False
        scales = self.model.scales
        nearest = self.model.smallest_distance(x)
        # What scripts press together stays together, however stiff the barrier is.
        helps = self.raises == 0 or nearest > _HELPS * self.nearest
        if scales.adaptive and self.raises < _MOST_RAISES and nearest < _TOO_NEAR * scales.dhat and helps:
            self.stiffness *= _STIFFER
            self.raises += 1
            self.nearest = nearest
            return True
        if self.model.coefficients.any() and self._friction_is_old(x):
            self.lagged += 1
            return True
        return False

    def _friction_is_old(self, x: NDArray[np.float64]) -> bool:
        """Whether friction has to be brought up to date with the normal forces at x (n, 3)."""
        assert self.model is not None
        assert self.barriers is not None
        wanted = self.model.friction_iterations
        if self.lagged + 1 >= (_MOST_LAGS if wanted is None else wanted):
            return False
        now = Objective(self.barriers.terms).gradient(x)
        changed = float(np.linalg.norm(now - self.pressing))
        return wanted is not None or changed > _PRESSED_DIFFERENTLY * float(np.linalg.norm(now))

    def verified(self, outcome: Outcome) -> Outcome:
        """The outcome, or a failure where rounding has let surfaces through each other after all.

        Every state that the next step may start from is tested, whether Newton's method has converged or not.
        """
        if self.model is None or not outcome.status.can_go_on:
            return outcome
        if self.model.collisions.intersect(outcome.end.positions):
            return replace(outcome, status=Status.LINE_SEARCH_FAILED, message="two surfaces intersect after the step")
        return outcome

    def completed(self, report: StepReport, x: NDArray[np.float64]) -> StepReport:
        """The report of a step that ended at x (n, 3), with what contact does there."""
        model, barriers = self.model, self.barriers
        if model is None or barriers is None:
            return report
        normal, tangential = np.zeros_like(x), np.zeros_like(x)
        for term in barriers.terms:
            term.add_gradient(x, normal)
        for term in self.frictions or ():
            term.add_gradient(x, tangential)
        nearest = model.smallest_distance(x)
        details = {
            **report.details,
            "contact_count": model.count(x),
            "contact_forces": forces_on_owners(model, normal / self.weight),
            "friction_forces": forces_on_owners(model, tangential / self.weight),
            "contact_stiffness": self.stiffness / self.weight,
            "dhat": model.scales.dhat,
        }
        return replace(
            report,
            min_distance=nearest if np.isfinite(nearest) else None,
            details=details,
            contacts=lambda: contact_points(model, barriers, x, self.weight),
        )
