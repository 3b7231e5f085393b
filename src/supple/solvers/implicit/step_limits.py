"""The bounds of a Newton step: no tet inverts, no surfaces touch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.solvers.implicit.contact.collisions import StepAlong
from supple.solvers.implicit.contact.model import ContactModel
from supple.solvers.implicit.inversion_guard import InversionGuard
from supple.solvers.implicit.timings import Clock

# Pieces that collide in one step; where there are more, all have one length.
_MOST_ROUNDS = 12


def are_in_pieces(vertices: NDArray[np.int32], pieces: NDArray[np.int32]) -> NDArray[np.bool_]:
    """(n,) which vertices are in a piece of one of the given ones (k,), where `pieces` (n,) has the numbers."""
    chosen = np.zeros(int(pieces.max(initial=0)) + 1, dtype=np.bool_)
    chosen[pieces[vertices]] = True
    return chosen[pieces]


class StepLimit(NamedTuple):
    """The largest step that is allowed, and what allows no more.

    Attributes
    ----------
    step : in [0, 1]; tet : the one that would lose too much of its volume, or -1
    points : two that are on the surfaces which would touch
    reason : "inversion of tet 5 of body 'a'", "contact of body 'a' and itself", or "length of the search for contacts",
        which ends before a very long direction does; "" for a whole step
    """

    step: float
    tet: int = -1
    reason: str = ""
    points: tuple[int, ...] = ()


@dataclass(eq=False)
class StepLimits:
    """The inversion guard and the bounds of contact together."""

    guard: InversionGuard
    contact: ContactModel | None
    clock: Clock

    def largest_step(self, x: NDArray[np.float64], direction: NDArray[np.float64]) -> StepLimit:
        """The largest step along `direction` (n, 3)."""
        return self._largest_step(x, direction, self._along(x, direction))

    def _along(self, x: NDArray[np.float64], direction: NDArray[np.float64]) -> StepAlong | None:
        if self.contact is None:
            return None
        with self.clock.of("contact"):
            return self.contact.collisions.along(x, direction)

    def _largest_step(
        self, x: NDArray[np.float64], direction: NDArray[np.float64], along: StepAlong | None
    ) -> StepLimit:
        with self.clock.of("elasticity"):
            step, tet = self.guard.largest_step(x, direction)
        inversion = StepLimit(step, tet, "" if tet < 0 else f"inversion of {self.guard.name(tet)}")
        if self.contact is None or along is None or step == 0.0:
            return inversion
        with self.clock.of("contact"):
            free, points = along.largest_step(step * direction)
        if free == 1.0:
            return inversion
        reason = f"contact of {self.contact.names(points)}" if points else "length of the search for contacts"
        return StepLimit(step * free, -1, reason, tuple(points))

    def shortened(
        self, x: NDArray[np.float64], direction: NDArray[np.float64], share: NDArray[np.float64] | float = 1.0
    ) -> tuple[NDArray[np.float64], StepLimit]:
        """A direction (n, 3) along which a whole step is allowed; and its least share, with what was first to limit it.

        Bodies that are joined or touch are shortened together, and others on their own: what collides does not stop
        what flies. They go this share (n, 1) of the way that is free.
        """
        along = self._along(x, direction)
        first = limit = self._largest_step(x, direction, along)
        if limit.step == 1.0:
            return direction, first
        taken, pieces = np.ones((len(x), 1)), self.guard.system.joined_components
        if self.contact is not None:
            pieces = self.contact.clusters(x, pieces)
        for _ in range(_MOST_ROUNDS):
            if limit.step == 1.0:
                break
            if limit.tet >= 0:
                meeting = self.guard.system.tets[limit.tet, :1]
            elif limit.points and self.contact is not None:
                meeting = self.contact.vertices(limit.points)
            else:
                break
            free = are_in_pieces(meeting, pieces)
            taken[free] *= limit.step * (share[free] if isinstance(share, np.ndarray) else share)
            limit = self._largest_step(x, taken * direction, along)
        taken *= limit.step
        return taken * direction, first._replace(step=float(taken.min(initial=1.0)))

    def allows(self, x: NDArray[np.float64]) -> bool:
        """Whether every guarded tet has a positive volume and every vertex is in front of every plane, in rounded
        numbers."""
        return self.guard.allows(x) and (self.contact is None or self.contact.allows(x))

    def widen(self, x: NDArray[np.float64]) -> None:
        """From now on, also guard the bodies that have no flat or inverted tet at x."""
        self.guard.widen(x)
