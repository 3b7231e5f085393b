"""The bounds of a Newton step: no tet inverts, no surfaces touch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.solvers.implicit.contact.model import ContactModel
from supple.solvers.implicit.inversion_guard import InversionGuard
from supple.solvers.implicit.timings import Clock


class StepLimit(NamedTuple):
    """The largest step that is allowed, and what allows no more.

    Attributes
    ----------
    step : in [0, 1]; tet : the one that would lose too much of its volume, or -1
    reason : "inversion of tet 5 of body 'a'", "contact of body 'a' and itself", or "length of the search for contacts",
        which ends before a very long direction does; "" for a whole step
    """

    step: float
    tet: int = -1
    reason: str = ""


@dataclass(eq=False)
class StepLimits:
    """The inversion guard and the bounds of contact together."""

    guard: InversionGuard
    contact: ContactModel | None
    clock: Clock

    def largest_step(self, x: NDArray[np.float64], direction: NDArray[np.float64]) -> StepLimit:
        """The largest step along `direction` (n, 3)."""
        with self.clock.of("elasticity"):
            step, tet = self.guard.largest_step(x, direction)
        inversion = StepLimit(step, tet, "" if tet < 0 else f"inversion of {self.guard.name(tet)}")
        if self.contact is None or step == 0.0:
            return inversion
        with self.clock.of("contact"):
            free, names = self.contact.largest_step(x, step * direction)
        if free == 1.0:
            return inversion
        return StepLimit(step * free, -1, f"contact of {names}" if names else "length of the search for contacts")

    def allows(self, x: NDArray[np.float64]) -> bool:
        """Whether every guarded tet has a positive volume and every vertex is in front of every plane, in rounded
        numbers."""
        return self.guard.allows(x) and (self.contact is None or self.contact.allows(x))

    def widen(self, x: NDArray[np.float64]) -> None:
        """From now on, also guard the bodies that have no flat or inverted tet at x."""
        self.guard.widen(x)
