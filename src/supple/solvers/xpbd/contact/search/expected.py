"""Where nodes are expected, if each of them goes straight on with the velocity that it had."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from supple.runtime.kernel_cache import njit


class Expected:
    """Where nodes were and how fast, when a list was made.

    Attributes
    ----------
    x, v : (N, 3) [m], [m/s]; clock : (2,) the time since then, and how long the list holds [s]
    """

    def __init__(self, count: int) -> None:
        self.x, self.v, self.clock = np.full((count, 3), np.inf), np.zeros((count, 3)), np.zeros(2)

    @property
    def arrays(self) -> tuple[NDArray[np.float64], ...]:
        """x, v and clock."""
        return self.x, self.v, self.clock

    @property
    def age(self) -> float:
        """The time since the list was made [s]."""
        return float(self.clock[0])

    @property
    def left(self) -> float:
        """How long the list still holds [s]."""
        return float(self.clock[1] - self.clock[0])

    def ends_within(self, h: float) -> bool:
        """Whether the list does not hold for a substep of h [s]."""
        return bool(self.clock[0] + h * (1.0 - 1e-9) > self.clock[1])

    def begin(self, x: NDArray[np.float64], v: NDArray[np.float64], time: float) -> None:
        """Expect of all nodes that they go on from x (N, >= 3) with v (N, 3) for a time [s]."""
        self.x[:], self.v[:], self.clock[:] = x[:, :3], v, (0.0, time)

    def correct(self, nodes: NDArray[np.bool_], x: NDArray[np.float64], v: NDArray[np.float64]) -> None:
        """Expect of some nodes (N,) that they go on from x with v."""
        self.v[nodes] = v[nodes]
        self.x[nodes] = x[nodes, :3] - self.age * v[nodes]

    @property
    def places(self) -> NDArray[np.float64]:
        """(N, 3) where nodes are expected."""
        return self.x + self.age * self.v

    def deviation(self, x: NDArray[np.float64], nodes: NDArray[np.int32]) -> float:
        """How far one of the nodes (s,) at x (N, >= 3) is from where it is expected, at most [m]; inf if not finite."""
        return largest_deviation(x, self.x, self.v, self.age, nodes)

    def off(self, x: NDArray[np.float64], nodes: NDArray[np.int32], most: float) -> NDArray[np.bool_]:
        """(N,) which of the nodes (s,) at x (N, >= 3) are farther than `most` [m] from where they are expected."""
        out = np.zeros(len(self.x), dtype=np.bool_)
        deviating(x, self.x, self.v, self.age, nodes, most, out)
        return out


@njit(cache=True)
def largest_deviation(x, begin, v, age, nodes):
    """See `Expected.deviation`."""
    most = 0.0
    for i in nodes:
        a, b, c = (
            x[i, 0] - begin[i, 0] - age * v[i, 0],
            x[i, 1] - begin[i, 1] - age * v[i, 1],
            x[i, 2] - begin[i, 2] - age * v[i, 2],
        )
        square = a * a + b * b + c * c
        if not square <= most:
            most = square if square < np.inf else np.inf
    return math.sqrt(most)


@njit(cache=True)
def deviating(x, begin, v, age, nodes, margin, left):
    """See `Expected.off`."""
    for i in nodes:
        a, b, c = (
            x[i, 0] - begin[i, 0] - age * v[i, 0],
            x[i, 1] - begin[i, 1] - age * v[i, 1],
            x[i, 2] - begin[i, 2] - age * v[i, 2],
        )
        left[i] = not a * a + b * b + c * c <= margin * margin


@njit(cache=True)
def fastest_square(v, nodes, owner, owners):
    """The square of the largest velocity of a node relative to the mean of its thing."""
    means = np.zeros((owners, 4))
    for i in nodes:
        o = owner[i]
        means[o, 3] += 1.0
        for j in range(3):
            means[o, j] += v[i, j]
    most = 0.0
    for i in nodes:
        o = owner[i]
        f = 1.0 / means[o, 3]
        a, b, c = v[i, 0] - f * means[o, 0], v[i, 1] - f * means[o, 1], v[i, 2] - f * means[o, 2]
        most = max(most, a * a + b * b + c * c, 0.02 * (v[i, 0] ** 2 + v[i, 1] ** 2 + v[i, 2] ** 2))
    return most
