"""The status of a frame: whether its end is what the solver promises, and otherwise what is wrong and where."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from supple.model.state import Status
from supple.model.system import System
from supple.solvers.xpbd.assessment.surfaces import Overlap

# The share of the scene's energy that may lack a source, and that of the substeps in which motion may be shortened.
ENERGY_TOLERANCE, HELD_TOLERANCE = 0.02, 0.1
# Of things with the same problem in one message.
MOST_NAMED = 3


@dataclass(frozen=True)
class Findings:
    """What was measured at the end of a frame.

    Attributes
    ----------
    inverted : number of inverted tets by body, without bodies that began with some
    overlaps : things that penetrate each other
    held : the share of the substeps in which the motion of bodies was shortened
    gained : energy without a source, so far, that has not been lost since, over the scene's energy [-]
    open : what works leave open, so far, over the scene's energy, where this frame has added to it [-]
    gainer : the body whose energy rose most in this frame
    softened : (share, body) for each body that is softer than the accuracy allows
    crushed : whether a tet has come below J = `CRUSHED` in this frame, see `supple.model.crushed`
    apart : (share of its size, joint) for each joint whose sides are too far apart
    stalled : (share of its way, joint) for each velocity motor that is too far behind without its largest effort
    """

    inverted: dict[str, int] = field(default_factory=dict)
    overlaps: list[Overlap] = field(default_factory=list)
    held: float = 0.0
    gained: float = 0.0
    open: float = 0.0
    gainer: str = ""
    softened: list[tuple[float, str]] = field(default_factory=list)
    crushed: bool = False
    apart: list[tuple[float, str]] = field(default_factory=list)
    stalled: list[tuple[float, str]] = field(default_factory=list)

    @property
    def status(self) -> Status:
        """The first that holds of those in `Status`."""
        return next((status for status, _ in self._problems()), Status.CONVERGED)

    def message(self, time: float, remedy: str) -> str:
        """One line: everything that is wrong, when, and what helps; empty where nothing is wrong."""
        texts = [text for _, text in self._problems()]
        return f"{', '.join(texts)} at t = {time:.4g} s; {remedy}" if texts else ""

    def _problems(self) -> list[tuple[Status, str]]:
        tets = [f"{n} {'tet' if n == 1 else 'tets'} of body {name!r} inverted" for name, n in self.inverted.items()]
        found = _first(Status.INVERTED, tets, "bodies")
        found += _first(Status.INTERSECTING, [str(overlap) for overlap in self.overlaps], "pairs")
        if self.gained > ENERGY_TOLERANCE:
            text = f"{_percent(self.gained)} of the energy has no source, most of it in body {self.gainer!r}"
            found.append((Status.ENERGY_GAINED, text))
        if self.held > HELD_TOLERANCE:
            found.append((Status.TRUNCATED, f"motion was truncated in {_percent(self.held)} of the substeps"))
        if self.open > ENERGY_TOLERANCE:
            text = f"works leave {_percent(self.open)} of the energy open, as motion was shortened"
            found.append((Status.TRUNCATED, text))
        softest = sorted(self.softened, reverse=True)
        soft = [f"body {name!r} about {_percent(share)} too soft" for share, name in softest]
        found += _first(Status.SOFTENED, soft, "bodies")
        for what, lacks in (("its size", self.apart), ("the way of its motor", self.stalled)):
            off = [f"{label} is off by {_percent(share)} of {what}" for share, label in lacks]
            found += _first(Status.SOFTENED, off, "joints")
        return found


def _first(status: Status, texts: list[str], things: str) -> list[tuple[Status, str]]:
    """The first `MOST_NAMED` of what is wrong with `things`, and how many others there are."""
    more = len(texts) - MOST_NAMED
    return [(status, text) for text in [*texts[:MOST_NAMED], *([f"{more} more such {things}"] if more > 0 else [])]]


def _percent(share: float) -> str:
    return f"{100.0 * share:.{0 if share >= 0.0995 else 2}{'f' if share >= 0.0995 else 'g'}} %"


def count_inverted(system: System, J: NDArray[np.float64], tangled: frozenset[str]) -> dict[str, int]:
    """Number of tets with J <= 0 of each body that has some, without the tangled ones; J (m,)."""
    if (J > 0.0).all():
        return {}
    bad = {part.name: int(np.count_nonzero(~(J[part.tets] > 0.0))) for part in system.bodies}
    return {name: count for name, count in bad.items() if count and name not in tangled}


def tangled_bodies(system: System, J: NDArray[np.float64]) -> frozenset[str]:
    """The bodies with a tet of J <= 0; J (m,)."""
    bad = ~(J > 0.0)
    return frozenset(part.name for part in system.bodies if bad[part.tets].any()) if bad.any() else frozenset()
