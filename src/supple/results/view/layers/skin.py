"""Bodies as smooth shaded surfaces: the fine skin where there is one, otherwise the boundary of the mesh."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.results.view.layers.layer import Layer, single
from supple.results.view.model import Model, Moment


class SkinView(Layer):
    """One mesh for each body, or only its lines."""

    def __init__(self, scene: Any, moment: Moment, *, lines: bool = False) -> None:
        self._parts = []
        for i, body in enumerate(moment.model.bodies):
            if body.skin is not None and not lines:
                used, triangles = None, body.skin.triangles
            else:
                used, rows = np.unique(body.triangles, return_inverse=True)
                triangles = rows.reshape(-1, 3)
            handle = scene.add_mesh_simple(
                f"/bodies/{i} {body.name}",
                single(_points(moment, body, used)),
                triangles.astype(np.uint32),
                color=body.color,
                wireframe=lines,
                side="double",
            )
            self._parts.append((handle, body, used))
        self.nodes = [handle for handle, _, _ in self._parts]

    def update(self, moment: Moment) -> None:
        for handle, body, used in self._parts:
            handle.vertices = single(_points(moment, body, used))


def _points(moment: Moment, body: Any, used: Any) -> Any:
    x = moment.finite_positions[body.vertices]
    return body.skin.positions(x) if used is None else x[used]


def drawn_points(model: Model) -> int:
    """Number of points of the smooth surfaces."""
    return sum(len(np.unique(b.triangles)) if b.skin is None else len(b.skin.corners) for b in model.bodies)
