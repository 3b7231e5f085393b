"""Which pin or weld holds each vertex of a scene: where one holds a whole triangle or edge, that is clamped."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from supple.scene.rows import rows_of

if TYPE_CHECKING:
    from supple.scene.scene import Scene


def holders(scene: Scene) -> NDArray[np.int64]:
    """(n,) the number of what holds each vertex of the bodies, pins before welds; -1 for nothing."""
    rows = {part.name: part for part in rows_of(scene.bodies)}
    out = np.full(max(part.vertices.stop for part in rows.values()), -1, dtype=np.int64)
    for number, pin in enumerate(scene.pins):
        part = rows[pin.body]
        out[pin.select(part.body.place(part.body.mesh.vertices)) + part.vertices.start] = number
    out[scene.welding.vertices] = scene.welding.weld + len(scene.pins)
    return out


def clamped(holder: NDArray[np.int64], elements: NDArray[np.integer]) -> NDArray[np.bool_]:
    """(k,) which of the elements (k, p) one thing holds at all of their vertices."""
    own = holder[elements]
    return (own[:, 0] >= 0) & (own == own[:, :1]).all(axis=1)
