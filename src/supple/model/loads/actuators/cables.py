"""Cables: their length, the sum of the distances between their points, and their friction at eyelets.

Friction follows the law of the capstan. Where the cable slips through an eyelet that turns it by the angle theta, the
tensions on both sides have the ratio exp(mu theta). With T on the side of the winch, the other side has T - f, where f
is T (1 - exp(-mu theta)) for a cable that moves to the winch and -T (exp(mu theta) - 1) for one that moves back. Below
a small speed, f increases from zero with the slip, as friction of contact does.

The slip at an eyelet is the decrease of the length of all spans before it: a cable is stiff beside what it moves.

Source: the capstan equation of Euler and Eytelwein; for the smooth friction, Li et al., "Incremental Potential Contact"
(2020), section 5.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from supple.model.loads.actuators.actuator import Coordinate
from supple.numerics.sparse.couplings import Couplings
from supple.runtime.kernel_cache import njit


@dataclass(frozen=True, eq=False)
class CableLength(Coordinate):
    """Its parts are the lengths of the spans.

    Attributes
    ----------
    vertices : (v,); weights : (p, v) of the points; offsets : (p, 3) of points that are fixed in the world [m]
    """

    vertices: NDArray[np.int32]
    weights: NDArray[np.float64]
    offsets: NDArray[np.float64]

    @cached_property
    def _differences(self) -> NDArray[np.float64]:
        """(p - 1, v) of the weights of the two ends of each span."""
        return np.diff(self.weights, axis=0)

    @property
    def is_anchored(self) -> bool:
        return bool((self.weights.sum(axis=1) < 0.5).any())

    def renumbered(self, new: NDArray[np.int32]) -> CableLength:
        return replace(self, vertices=new[self.vertices])

    @property
    def count(self) -> int:
        return len(self.weights) - 1

    def spans(self, own: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lengths (p - 1,) [m] and unit vectors (p - 1, 3), zero where two points coincide."""
        lengths, directions = np.empty(self.count), np.empty((self.count, 3))
        _spans(self.weights, self.offsets, own, lengths, directions)
        return lengths, directions

    def measure(self, own: NDArray[np.float64], parts: NDArray[np.float64]) -> None:
        _spans(self.weights, self.offsets, own, parts, np.empty((self.count, 3)))

    def differentiate(
        self, own: NDArray[np.float64], parts: NDArray[np.float64], gradients: NDArray[np.float64]
    ) -> None:
        parts[:], directions = self.spans(own)
        np.multiply(self._differences[:, :, None], directions[:, None, :], out=gradients)

    def hessian(self, own: NDArray[np.float64], factors: NDArray[np.float64], project: bool) -> Couplings | None:
        """Positive semi-definite for factors of zero or more: (1 - n n^T) / l between the ends of each span."""
        lengths, directions = self.spans(own)
        pulled = np.flatnonzero((lengths > 0.0) & ((factors > 0.0) if project else (factors != 0.0)))
        if len(pulled) == 0:
            return None
        i, j = np.triu_indices(len(self.vertices))
        blocks = np.zeros((len(i), 3, 3))
        for k, c in zip(pulled, self._differences[pulled], strict=True):
            across = factors[k] / lengths[k] * (np.eye(3) - np.outer(directions[k], directions[k]))
            blocks += (c[i] * c[j])[:, None, None] * across
        return Couplings(self.vertices[i], self.vertices[j], blocks)


@njit(cache=True)
def _spans(weights, offsets, own, lengths, directions):
    """Not by matrix products, which take longer to begin than to compute for so few vertices."""
    before = np.zeros(3)
    for p in range(len(weights)):
        x, y, z = offsets[p, 0], offsets[p, 1], offsets[p, 2]
        for i in range(len(own)):
            w = weights[p, i]
            if w != 0.0:
                x += w * own[i, 0]
                y += w * own[i, 1]
                z += w * own[i, 2]
        if p > 0:
            dx, dy, dz = x - before[0], y - before[1], z - before[2]
            length = np.sqrt(dx * dx + dy * dy + dz * dz)
            factor = 1.0 / length if length > 0.0 else 0.0
            lengths[p - 1] = length
            directions[p - 1, 0], directions[p - 1, 1], directions[p - 1, 2] = dx * factor, dy * factor, dz * factor
        before[0], before[1], before[2] = x, y, z


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
