"""The frames of the edges of rods, with first and second derivatives.

An edge e = x_j - x_i has the frame (d_1, d_2, t): t along it, d_1 towards its first material point, d_2 = t x d_1. With
u half of the way from its second material point to its first one, it is a function of e and u alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Jet:
    """Values with their derivatives by e and u.

    Attributes
    ----------
    value : (e, k); first : (e, k, 6); second : (e, k, 6, 6)
    """

    value: Floats
    first: Floats
    second: Floats

    def __mul__(self, other: Jet) -> Jet:
        """Componentwise; one component times each of several."""
        cross = np.einsum("eka,ekb->ekab", *np.broadcast_arrays(self.first, other.first))
        return Jet(
            self.value * other.value,
            self.first * other.value[:, :, None] + self.value[:, :, None] * other.first,
            self.second * other.value[:, :, None, None]
            + self.value[:, :, None, None] * other.second
            + cross
            + np.swapaxes(cross, 2, 3),
        )

    def __sub__(self, other: Jet) -> Jet:
        return Jet(self.value - other.value, self.first - other.first, self.second - other.second)

    def taken(self, components: list[int]) -> Jet:
        return Jet(self.value[:, components], self.first[:, components], self.second[:, components])

    def sum(self) -> Jet:
        """Of the components."""
        return Jet(*(part.sum(axis=1, keepdims=True) for part in (self.value, self.first, self.second)))

    def inverse_root(self) -> Jet:
        """To the power -1/2."""
        root = self.value**-0.5
        one, two = -0.5 * root / self.value, 0.75 * root / self.value**2
        second = two[:, :, None, None] * np.einsum("eka,ekb->ekab", self.first, self.first)
        return Jet(root, one[:, :, None] * self.first, second + one[:, :, None, None] * self.second)

    def unit(self) -> Jet:
        """The vector of three components at unit length."""
        return self * (self * self).sum().inverse_root()

    def cross(self, other: Jet) -> Jet:
        one, two = [1, 2, 0], [2, 0, 1]
        return self.taken(one) * other.taken(two) - self.taken(two) * other.taken(one)


def variable(values: Floats, first: int) -> Jet:
    """The components `first` to `first` + 2 of e and u, with values (e, 3)."""
    slopes = np.zeros((3, 6))
    slopes[:, first : first + 3] = np.eye(3)
    return Jet(values, np.broadcast_to(slopes, (len(values), 3, 6)), np.zeros((len(values), 3, 6, 6)))


def frames(e: Floats, u: Floats) -> Floats:
    """(e, 3, 3) the vectors d_1, d_2, t of edges (e, 3), as columns."""
    t = e / np.linalg.norm(e, axis=1)[:, None]
    across = u - np.einsum("ei,ei->e", u, t)[:, None] * t
    d = across / np.linalg.norm(across, axis=1)[:, None]
    return np.stack([d, np.cross(t, d), t], axis=2)


def frame_jets(e: Floats, u: Floats) -> tuple[Floats, Floats, Floats]:
    """The frames (e, 3, 3) with the vectors as columns, and their derivatives (e, 3, 3, 6), (e, 3, 3, 6, 6)."""
    along, towards = variable(e, 0), variable(u, 3)
    t = along.unit()
    d = (towards - (towards * t).sum() * t).unit()
    vectors = d, t.cross(d), t
    value, first, second = (
        np.stack([getattr(v, part) for v in vectors], axis=2) for part in ("value", "first", "second")
    )
    return value, first, second
