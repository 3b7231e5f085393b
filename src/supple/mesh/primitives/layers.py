"""Layers of prisms between copies of a surface, each cut into three tets."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def tets_between_layers(triangles: NDArray[np.integer], points: int, layers: int) -> NDArray[np.int64]:
    """(3 t layers, 4) tets between layers + 1 copies of triangles (t, 3), of so many points each.

    The quad between two columns is cut from the bottom of the lower-numbered one, so that neighbours agree.
    """
    a0, a1, a2 = np.sort(triangles.astype(np.int64), axis=1).T
    b0, b1, b2 = a0 + points, a1 + points, a2 + points
    layer = np.concatenate([np.column_stack(t) for t in ((a0, a1, a2, b2), (a0, a1, b1, b2), (a0, b0, b1, b2))])
    return (layer[None] + points * np.arange(layers)[:, None, None]).reshape(-1, 4)
