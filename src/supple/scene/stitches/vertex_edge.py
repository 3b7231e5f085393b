"""The vertex-edge stitch: a spring between a vertex and the point of an edge that is nearest to it at the start."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from supple.scene.stitches.elements import Pairs, Springs
from supple.scene.stitches.side import Side
from supple.scene.stitches.spring import SpringStitch


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
