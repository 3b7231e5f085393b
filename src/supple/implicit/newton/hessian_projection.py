"""Which terms of the objective are modelled convex, from iteration to iteration of Newton's method.

Far from the minimum all are. Near it, and where a body buckles, convexity costs the quadratic rate of convergence: then
the true Hessian is tried, first with contact still convex, which is what most often makes it indefinite.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

# After the true Hessian was indefinite: so many slow iterations until it is tried again, twice as many each time, at
# most. Trying is cheap, since CG finds out before it has converged.
_MOST_PATIENCE = 4


class Convexity(IntEnum):
    """The terms whose Hessians are projected to be positive semi-definite."""

    ALL = 0
    CONTACT = 1
    NONE = 2

    def projects(self, label: str) -> bool:
        """Whether a term with this `Potential.label` is projected."""
        return self is Convexity.ALL or (self is Convexity.CONTACT and label == "contact")


@dataclass(eq=False)
class ConvexityChoice:
    """What one minimization has learnt.

    Attributes
    ----------
    now : what to use next; patience : slow iterations to wait after the last failure; remaining : of them
    """

    now: Convexity = Convexity.ALL
    patience: int = 1
    remaining: int = 1

    def note(self, slow: bool, touching: bool) -> None:
        """After an iteration: whether it converged slowly, and whether there is contact."""
        if not slow:
            self.remaining = max(self.remaining, 1)
            return
        self.remaining -= 1
        if self.remaining > 0 or self.now is Convexity.NONE:
            return
        self.now = Convexity.CONTACT if touching and self.now is Convexity.ALL else Convexity.NONE
        self.remaining = self.patience

    def refuse(self, touching: bool) -> None:
        """The Hessian of what is chosen now turned out not to be positive definite."""
        self.now = Convexity.CONTACT if touching and self.now is Convexity.NONE else Convexity.ALL
        self.patience = min(2 * self.patience, _MOST_PATIENCE)
        self.remaining = self.patience
