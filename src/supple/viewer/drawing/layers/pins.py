"""Pinned vertices."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.viewer.drawing.layers.primitives.layer import Layer, single
from supple.viewer.drawing.moments.model import Moment


class PinView(Layer):
    """A dot for each pinned vertex."""

    def __init__(self, scene: Any, moment: Moment) -> None:
        self._dots = scene.add_point_cloud(
            "/pins",
            np.zeros((1, 3), dtype=np.float32),
            (20, 20, 24),
            point_size=0.04 * moment.model.view.radius,
            point_shape="circle",
            visible=False,
        )
        self.update(moment)

    def update(self, moment: Moment) -> None:
        some = bool(len(moment.pinned))
        if some:
            self._dots.points = single(moment.finite_positions[moment.pinned])
        if self._dots.visible != some:
            self._dots.visible = some

    def remove(self) -> None:
        self._dots.remove()
