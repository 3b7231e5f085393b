"""Velocities of the surface, as arrows."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.results.view.layers.layer import Layer, single
from supple.results.view.model import Moment

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
        self._head = _HEAD * model.view.radius
        self._arrows = scene.add_arrows(
            "/velocities",
            np.zeros((1, 2, 3)),
            (40, 60, 90),
            shaft_radius=0.15 * self._head,
            head_radius=0.4 * self._head,
            head_length=self._head,
            visible=False,
        )
        self.nodes = [self._arrows]
        self.update(moment)

    def update(self, moment: Moment) -> None:
        if moment.velocities is None:
            return
        start = moment.finite_positions[self._rows]
        way = np.nan_to_num(_SECONDS * moment.velocities[self._rows], posinf=0.0, neginf=0.0)
        length = np.linalg.norm(way, axis=1, keepdims=True)
        way *= np.minimum(1.0, self._longest / np.maximum(length, 1e-300))
        some = np.linalg.norm(way, axis=1) >= self._head  # shorter arrows than their head are not drawn
        self._arrows.visible = bool(some.any())
        if some.any():
            self._arrows.points = single(np.stack([start[some], (start + way)[some]], axis=1))
