"""Which terms' Hessians are projected to be positive semi-definite, from iteration to iteration of Newton's method.

Far from the minimum all are. Near it, and where a body buckles, projection costs the quadratic rate of convergence:
then the true Hessian is tried, first with contact still projected, which most often makes it indefinite.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from supple.solvers.implicit.energies.potential import Projection

# After the true Hessian was indefinite: the number of slow iterations until it is tried again. It doubles with every
# failure, up to this. A trial is cheap with CG, which finds out before it has converged.
_LONGEST_WAIT = 4


class ProjectedTerms(IntEnum):
    """The terms whose Hessians are projected in an iteration."""

    ALL = 0
    RELEASED_LAST = 1
    NONE = 2

    def includes(self, projection: Projection) -> bool:
        """Whether a term that declares this `Potential.projection` is projected."""
        if projection is Projection.RELEASED_LAST:
            return self is not ProjectedTerms.NONE
        return self is ProjectedTerms.ALL and projection is Projection.RELEASED_FIRST


@dataclass(eq=False)
class ProjectionPolicy:
    """The state of the choice in one minimization.

    Attributes
    ----------
    now : the terms to project next
    wait : slow iterations between a failure of the true Hessian and its next trial; remaining : of them
    """

    now: ProjectedTerms = ProjectedTerms.ALL
    wait: int = 1
    remaining: int = 1

    def note(self, slow: bool, touching: bool) -> None:
        """After an iteration: whether it converged slowly, and whether surfaces touch."""
        if not slow:
            self.remaining = max(self.remaining, 1)
            return
        self.remaining -= 1
        if self.remaining > 0 or self.now is ProjectedTerms.NONE:
            return
        first = touching and self.now is ProjectedTerms.ALL
        self.now = ProjectedTerms.RELEASED_LAST if first else ProjectedTerms.NONE
        self.remaining = self.wait

    def step_back(self, touching: bool) -> None:
        """The Hessian with the present choice is not positive definite: project more terms."""
        some = touching and self.now is ProjectedTerms.NONE
        self.now = ProjectedTerms.RELEASED_LAST if some else ProjectedTerms.ALL
        self.wait = min(2 * self.wait, _LONGEST_WAIT)
        self.remaining = self.wait
