"""Velocities of the surface, as arrows."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.viewer.drawing.layers.primitives.arrows import Arrows
from supple.viewer.drawing.layers.primitives.layer import Layer
from supple.viewer.drawing.moments.model import Moment

_MOST = 400  # arrows; more cannot be distinguished
_HEAD = 0.04  # length of the head of an arrow, as a share of the size of the scene
_SECONDS = 0.15  # the length of an arrow is the distance in this time


class VelocityView(Layer):
    """Arrows at some vertices of the surface."""

    def __init__(self, scene: Any, moment: Moment) -> None:
        model = moment.model
        chosen = np.linspace(0, len(model.surface_vertices) - 1, min(_MOST, len(model.surface_vertices)))
        self._rows = model.surface_vertices[np.unique(chosen.astype(np.int64))]
        self._longest = 0.5 * model.view.radius
        self._arrows = Arrows(scene, "/velocities", (40, 60, 90), _HEAD * model.view.radius)
        self.update(moment)

    def update(self, moment: Moment) -> None:
        if moment.velocities is None:
            return
        start = moment.finite_positions[self._rows]
        way = np.nan_to_num(_SECONDS * moment.velocities[self._rows], posinf=0.0, neginf=0.0)
        length = np.linalg.norm(way, axis=1, keepdims=True)
        way *= np.minimum(1.0, self._longest / np.maximum(length, 1e-300))
        # Arrows shorter than their head are not drawn.
        way[np.linalg.norm(way, axis=1) < _HEAD * moment.model.view.radius] = 0.0
        self._arrows.update(start, start + way)

    def remove(self) -> None:
        self._arrows.remove()
