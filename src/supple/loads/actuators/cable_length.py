"""The length of a cable, the sum of the distances between its points, each a combination of vertices."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from supple.loads.actuators.actuator import Coordinate
from supple.numerics.sparse.couplings import Couplings


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

    @property
    def is_anchored(self) -> bool:
        return bool((self.weights.sum(axis=1) < 0.5).any())

    def renumbered(self, new: NDArray[np.int32]) -> CableLength:
        return replace(self, vertices=new[self.vertices])

    def spans(self, own: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lengths (p - 1,) [m] and unit vectors (p - 1, 3), zero where two points coincide."""
        points = self.weights @ own + self.offsets
        ways = points[1:] - points[:-1]
        lengths = np.sqrt(np.einsum("ij,ij->i", ways, ways))
        return lengths, ways / np.where(lengths > 0.0, lengths, np.inf)[:, None]

    def parts(self, own: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.spans(own)[0]

    def part_gradients(self, own: NDArray[np.float64]) -> NDArray[np.float64]:
        directions = self.spans(own)[1]
        return np.diff(self.weights, axis=0)[:, :, None] * directions[:, None, :]

    def hessian(self, own: NDArray[np.float64], factors: NDArray[np.float64], project: bool) -> Couplings | None:
        """Positive semi-definite for factors of zero or more: (1 - n n^T) / l between the ends of each span."""
        lengths, directions = self.spans(own)
        pulled = np.flatnonzero((lengths > 0.0) & ((factors > 0.0) if project else (factors != 0.0)))
        if len(pulled) == 0:
            return None
        i, j = np.triu_indices(len(self.vertices))
        blocks = np.zeros((len(i), 3, 3))
        for k, c in zip(pulled, np.diff(self.weights, axis=0)[pulled], strict=True):
            across = factors[k] / lengths[k] * (np.eye(3) - np.outer(directions[k], directions[k]))
            blocks += (c[i] * c[j])[:, None, None] * across
        return Couplings(self.vertices[i], self.vertices[j], blocks)
