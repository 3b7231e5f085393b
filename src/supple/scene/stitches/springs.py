"""Stitches that are springs: from a vertex to a vertex or to a point on an edge."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from supple.kinds.validators import NON_NEGATIVE, POSITIVE
from supple.scene.stitches.elements import Pairs, Springs
from supple.scene.stitches.side import Side
from supple.scene.stitches.stitch import PerPair, Stitch


@dataclass(frozen=True, eq=False)
class SpringStitch(Stitch):
    """Springs, k/2 (distance - rest length)^2. Other parameters: see `Stitch`.

    Parameters
    ----------
    stiffness : k [N/m]
    rest_length : [m]; None for the distance at the start

    Each is one number, or one for each pair.
    """

    stiffness: Annotated[float | NDArray[np.float64], PerPair(POSITIVE)] = field(kw_only=True)
    rest_length: Annotated[float | NDArray[np.float64] | None, PerPair(NON_NEGATIVE)] = field(
        default=None, kw_only=True
    )

    def springs(self, pairs: Pairs, ends: NDArray[np.int32], place: NDArray[np.float64]) -> Springs:
        """From the pairs' vertices to the places (k,) along ends (k, 2)."""
        count = len(pairs.vertices)
        lengths = pairs.distances if self.rest_length is None else self.rest_length
        return Springs(
            vertices=np.column_stack([pairs.vertices, ends]).astype(np.int32),
            place=place,
            stiffness=self.per_pair(self.stiffness, count, "stiffness"),
            rest_lengths=self.per_pair(lengths, count, "rest_length"),
            damping=np.full(count, self.damping),
        )


@dataclass(frozen=True, eq=False)
class VertexEdgeStitch(SpringStitch):
    """Springs from vertices to points of edges, which do not move along the edge. See `SpringStitch`.

    Pairs are (vertex of the first body, row of the second body's `mesh.surface.edges`, or of an obstacle's
    `surface.edges`).
    """

    kind: ClassVar[str] = "vertex_edge"
    partner = "edges"

    def partners(self, second: Side) -> NDArray[np.int32]:
        return second.edges[:, [0, 1, 1]]

    def join(self, first: Side, second: Side, pairs: Pairs) -> Springs:
        ends = second.edges[pairs.rows]
        a, b = second.points[ends].transpose(1, 0, 2)
        along, off = b - a, first.points[pairs.vertices] - a
        squares = np.einsum("ij,ij->i", along, along)
        places = np.clip(np.einsum("ij,ij->i", along, off) / np.where(squares > 0.0, squares, 1.0), 0.0, 1.0)
        return self.springs(pairs, ends, places)


@dataclass(frozen=True, eq=False)
class VertexVertexStitch(SpringStitch):
    """Springs between vertices. Pairs are (vertex of the first body, vertex of the second). See `SpringStitch`."""

    kind: ClassVar[str] = "vertex_vertex"
    partner = "vertices"

    def partners(self, second: Side) -> NDArray[np.int32]:
        return np.repeat(np.arange(len(second.points), dtype=np.int32)[:, None], 3, axis=1)

    def surface_partners(self, second: Side) -> NDArray[np.int32]:
        """See `Stitch`. Vertices inside the second body can be given as pairs, but are never found."""
        return second.surface_vertices

    def join(self, first: Side, second: Side, pairs: Pairs) -> Springs:
        return self.springs(pairs, np.repeat(pairs.rows[:, None], 2, axis=1), np.zeros(len(pairs.rows)))
