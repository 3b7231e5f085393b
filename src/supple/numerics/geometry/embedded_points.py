"""Points that move with the vertices of a system, affine combinations of a few vertices each; matrices between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from supple.numerics.sparse.couplings import Couplings
from supple.runtime.kernel_cache import njit


@dataclass(frozen=True, eq=False)
class EmbeddedPoints:
    """Points W x of vertices x, where the weights of each point sum to 1.

    Attributes
    ----------
    start : (s + 1,) int32, where the combination of each point begins
    vertices : (q,) int32; weights : (q,) float64
    """

    start: NDArray[np.int32]
    vertices: NDArray[np.int32]
    weights: NDArray[np.float64]

    @classmethod
    def at_vertices(cls, vertices: NDArray[np.int32]) -> EmbeddedPoints:
        """One point at each of the vertices (s,), which are all different."""
        start = np.arange(len(vertices) + 1, dtype=np.int32)
        return cls(start, np.ascontiguousarray(vertices, dtype=np.int32), np.ones(len(vertices)))

    @classmethod
    def none(cls) -> EmbeddedPoints:
        """No points."""
        return cls.at_vertices(np.zeros(0, dtype=np.int32))

    @classmethod
    def in_rows(cls, vertices: NDArray[np.int32], weights: NDArray[np.float64]) -> EmbeddedPoints:
        """Points that are all combinations of as many vertices: vertices and weights (s, w)."""
        s, width = vertices.shape
        start = np.arange(0, s * width + 1, width, dtype=np.int32)
        return cls(start, np.ascontiguousarray(vertices.ravel(), dtype=np.int32), np.ascontiguousarray(weights.ravel()))

    @classmethod
    def joined(cls, parts: Sequence[EmbeddedPoints]) -> EmbeddedPoints:
        """All points of the parts, which name vertices of the same system."""
        counts = np.concatenate([np.zeros(1, np.int64), *(np.diff(part.start) for part in parts)])
        return cls(
            np.cumsum(counts).astype(np.int32),
            np.concatenate([np.zeros(0, np.int32), *(part.vertices for part in parts)]),
            np.concatenate([np.zeros(0), *(part.weights for part in parts)]),
        )

    def __len__(self) -> int:
        return len(self.start) - 1

    def shifted(self, offset: int) -> EmbeddedPoints:
        """The same points of vertices whose numbers are larger by `offset`."""
        return EmbeddedPoints(self.start, self.vertices + np.int32(offset), self.weights)

    def taken(self, rows: NDArray[np.integer]) -> EmbeddedPoints:
        """Some of the points (k,)."""
        counts = np.diff(self.start)[rows]
        start = np.concatenate([np.zeros(1, np.int64), np.cumsum(counts)])
        entries = np.repeat(self.start[:-1][rows] - start[:-1], counts) + np.arange(start[-1])
        return EmbeddedPoints(start.astype(np.int32), self.vertices[entries], self.weights[entries])

    @cached_property
    def single(self) -> NDArray[np.int32]:
        """(s,) the vertex that each point is, -1 for a combination of several."""
        alone = np.diff(self.start) == 1
        out = np.full(len(self), -1, dtype=np.int32)
        out[alone] = self.vertices[self.start[:-1][alone]]
        return out

    @cached_property
    def are_vertices(self) -> bool:
        """Whether every point is one vertex, and no vertex has two points."""
        return len(self.vertices) == len(self) and len(np.unique(self.vertices)) == len(self)

    def positions(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(s, 3) positions of the points, or displacements, from those of all vertices x (n, 3)."""
        if self.are_vertices:
            return x.take(self.vertices, axis=0)
        out = np.empty((len(self), 3))
        _combine(x, self.start, self.vertices, self.weights, out)
        return out

    def add_forces(self, forces: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        """Add W^T forces, of forces (s, 3) on the points, to `out` (n, 3)."""
        _spread(forces, self.start, self.vertices, self.weights, out)


@njit(cache=True)
def _combine(x, start, vertices, weights, out):
    for i in range(len(start) - 1):
        for j in range(3):
            total = 0.0
            for k in range(start[i], start[i + 1]):
                total += weights[k] * x[vertices[k], j]
            out[i, j] = total


@njit(cache=True)
def _spread(forces, start, vertices, weights, out):
    for i in range(len(start) - 1):
        for k in range(start[i], start[i + 1]):
            for j in range(3):
                out[vertices[k], j] += weights[k] * forces[i, j]


def vertex_couplings(points: EmbeddedPoints, between: Couplings) -> Couplings:
    """The couplings of vertices, from those `between` points."""
    if points.are_vertices:
        return Couplings(points.vertices[between.rows], points.vertices[between.columns], between.blocks)
    return Couplings(
        *_spread_couplings(between.rows, between.columns, between.blocks, points.start, points.vertices, points.weights)
    )


@njit(cache=True)
def _spread_couplings(rows, columns, blocks, start, vertices, weights):
    count = 0
    for t in range(len(rows)):
        one, other = start[rows[t] + 1] - start[rows[t]], start[columns[t] + 1] - start[columns[t]]
        count += one * (one + 1) // 2 if rows[t] == columns[t] else one * other
    new_rows, new_columns = np.empty(count, dtype=np.int32), np.empty(count, dtype=np.int32)
    out = np.empty((count, 3, 3))
    b = 0
    for t in range(len(rows)):
        for k in range(start[rows[t]], start[rows[t] + 1]):
            # Each unordered pair of the vertices of one point is given once.
            for m in range(k if rows[t] == columns[t] else start[columns[t]], start[columns[t] + 1]):
                i, j, size = vertices[k], vertices[m], weights[k] * weights[m]
                new_rows[b], new_columns[b] = i, j
                for p in range(3):
                    for q in range(3):
                        out[b, p, q] = size * blocks[t, p, q]
                        # Two points on one vertex: its block contains the pair in both orders.
                        if i == j and (rows[t] != columns[t] or k != m):
                            out[b, p, q] += size * blocks[t, q, p]
                b += 1
    return new_rows, new_columns, out
