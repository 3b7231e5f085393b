"""Friction of a cable at its eyelets, by the law of the capstan.

Where the cable slips through an eyelet that turns it by the angle theta, the tensions on both sides have the ratio
exp(mu theta). With T on the side of the winch, the other side has T - f, where f is T (1 - exp(-mu theta)) for a cable
that moves to the winch and -T (exp(mu theta) - 1) for one that moves back. Below a small speed, f increases from zero
with the slip, as friction of contact does.

The slip at an eyelet is the decrease of the length of all spans before it: a cable is stiff beside what it moves.

Source: the capstan equation of Euler and Eytelwein; for the smooth friction, Li et al., "Incremental Potential Contact"
(2020), section 5.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from supple.runtime.kernel_cache import njit

# Of the length of the cable per second: slower slip counts as sticking.
CREEP = 1e-3


@njit(cache=True)
def turn_at(directions, e):
    """The angle by which eyelet e turns a cable with spans along the unit vectors (s, 3) [rad]."""
    cosine = 0.0
    for j in range(3):
        cosine += directions[e, j] * directions[e + 1, j]
    return np.arccos(min(max(cosine, -1.0), 1.0))


@njit(cache=True)
def limits(tension, angle, friction):
    """The largest f towards the winch and away from it, for the tension on the side of the winch [N]."""
    return -tension * np.expm1(-friction * angle), tension * np.expm1(friction * angle)


def smooth_share(slip: float, reach: float) -> tuple[float, float, float]:
    """Of the largest force: its integral over the slip [m], itself, and its derivative [1/m]; `reach` above zero."""
    u = abs(slip)
    if u >= reach:
        return u - reach / 3.0, float(np.sign(slip)), 0.0
    share = 2.0 * u / reach - (u / reach) ** 2
    return u * u / reach - u**3 / (3.0 * reach**2), float(np.copysign(share, slip)), 2.0 / reach - 2.0 * u / reach**2


@dataclass(eq=False)
class EyeletFriction:
    """The eyelets of one cable in one step, as a potential of the lengths (s,) of its spans.

    The largest forces are unknowns of the minimization; `renew` sets them.

    Attributes
    ----------
    friction : coefficient; start : (s,) lengths where the step begins [m]
    reach : slip in the step below which the cable sticks [m]
    """

    friction: float
    start: NDArray[np.float64]
    reach: float
    limits: list[tuple[float, float]] = field(init=False)

    def __post_init__(self) -> None:
        self.limits = [(0.0, 0.0)] * (len(self.start) - 1)

    def slips(self, parts: NDArray[np.float64]) -> NDArray[np.float64]:
        """(s - 1,) towards the winch [m]."""
        return -np.cumsum(parts - self.start)[:-1]

    def energy(self, parts: NDArray[np.float64]) -> float:
        """[J]"""
        largest = self._largest(parts)
        return sum(F * smooth_share(slip, self.reach)[0] for F, slip in zip(largest, self.slips(parts), strict=True))

    def forces(self, parts: NDArray[np.float64]) -> NDArray[np.float64]:
        """(s - 1,) f of each eyelet [N]."""
        shares = [smooth_share(slip, self.reach)[1] for slip in self.slips(parts)]
        return np.array(self._largest(parts)) * shares

    def stiffness(self, parts: NDArray[np.float64]) -> NDArray[np.float64]:
        """(s - 1,) df by the slip [N/m]."""
        shares = [smooth_share(slip, self.reach)[2] for slip in self.slips(parts)]
        return np.array(self._largest(parts)) * shares

    def renew(self, parts: NDArray[np.float64], directions: NDArray[np.float64], tension: float) -> None:
        """Take the largest forces of a cable with this tension at the winch [N], from the winch to its other end."""
        slips = self.slips(parts)
        for e in reversed(range(len(slips))):
            self.limits[e] = limits(tension, turn_at(directions, e), self.friction)
            tension -= self.limits[e][0 if slips[e] >= 0.0 else 1] * smooth_share(float(slips[e]), self.reach)[1]

    def _largest(self, parts: NDArray[np.float64]) -> list[float]:
        """(s - 1,) the largest f in the direction of the slip [N]."""
        pairs = zip(self.limits, self.slips(parts), strict=True)
        return [towards if slip >= 0.0 else away for (towards, away), slip in pairs]


def span_forces(force: float, of_eyelets: NDArray[np.float64]) -> NDArray[np.float64]:
    """(s,) generalized forces on the spans: minus their tensions, for that of the whole cable and f (s - 1,) [N]."""
    out = np.full(len(of_eyelets) + 1, force)
    if len(of_eyelets):
        out[:-1] += np.cumsum(of_eyelets[::-1])[::-1]
    return out
