"""The vertex-vertex stitch: a spring between two vertices."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from supple.scene.stitches.elements import Pairs, Springs
from supple.scene.stitches.side import Side
from supple.scene.stitches.spring import SpringStitch


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
