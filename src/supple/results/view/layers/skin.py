"""Bodies as shaded surfaces: the fine skin where there is one, otherwise the boundary of the mesh."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.results.view.layers.layer import Layer, single
from supple.results.view.model import Moment
from supple.results.view.surfaces import body_surface, boundary_surface


class SkinView(Layer):
    """One mesh for each body, or only the lines of its boundary."""

    def __init__(self, scene: Any, moment: Moment, *, lines: bool = False) -> None:
        model, self._parts = moment.model, []
        for i, body in enumerate(model.bodies):
            surface = boundary_surface(body) if lines else body_surface(model, body).creased(model)
            handle = scene.add_mesh_simple(
                f"/bodies/{i} {body.name}",
                single(surface.at(moment)),
                surface.triangles.astype(np.uint32),
                color=surface.color,
                wireframe=lines,
                side="double",
            )
            self._parts.append((handle, surface))
        self.nodes = [handle for handle, _ in self._parts]

    def update(self, moment: Moment) -> None:
        for handle, surface in self._parts:
            handle.vertices = single(surface.at(moment))
