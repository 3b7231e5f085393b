"""The length of a cable, the sum of the distances between its points, each a combination of vertices."""

from __future__ import annotations

from dataclasses import dataclass, replace
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
