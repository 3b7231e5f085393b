"""The bounds of a Newton step: no tet inverts, no surfaces touch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.implicit.contact.model import ContactModel
from supple.implicit.limits.inversion_guard import InversionGuard
from supple.implicit.timings import Clock


@dataclass(eq=False)
class StepLimits:
    """The inversion guard and the bounds of contact together."""

    guard: InversionGuard
    contact: ContactModel | None
    clock: Clock

    def largest_step(self, x: NDArray[np.float64], direction: NDArray[np.float64]) -> tuple[float, int]:
        """The largest step along `direction`, at most 1, and the tet that limits it (-1: none, or a contact)."""
        with self.clock.of("elasticity"):
            step, tet = self.guard.largest_step(x, direction)
        if self.contact is None or step == 0.0:
            return step, tet
        with self.clock.of("contact"):
            free = self.contact.largest_step(x, step * direction)
        return (step, tet) if free == 1.0 else (step * free, -1)

    def allows(self, x: NDArray[np.float64]) -> bool:
        """Whether every guarded tet has a positive volume and every vertex is in front of every plane, in rounded
        numbers."""
        return self.guard.allows(x) and (self.contact is None or self.contact.allows(x))

    def widen(self, x: NDArray[np.float64]) -> None:
        """From now on, also guard the bodies that have no flat or inverted tet at x."""
        self.guard.widen(x)
