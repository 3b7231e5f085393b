"""A grid on the ground, which shows the position of the floor and the scale."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from supple.viewer.drawing.layers.primitives.layer import Layer
from supple.viewer.drawing.layers.primitives.rotation import turning_z_to
from supple.viewer.drawing.moments.model import Moment


class Ground(Layer):
    """Lines on the floor, or below the bodies where there is no floor."""

    def __init__(self, scene: Any, moment: Moment) -> None:
        model = moment.model
        view, up = model.view, model.view.up
        planes = [one.obstacle.plane for one in model.obstacles]
        floors = [plane[0] for plane in planes if plane is not None and float(plane[1] @ up) > 0.99]
        lowest = float(np.min([corner @ up for corner in _corners(view.low, view.high)]))
        height = max((float(point @ up) for point in floors), default=lowest)
        # Slightly above the floor, because two surfaces in the same plane flicker.
        place = view.center + (height + 2e-3 * view.radius - float(view.center @ up)) * up
        cell = 10.0 ** math.floor(math.log10(view.radius))
        grid = scene.add_grid(
            "/ground",
            width=5.0 * view.radius,
            height=5.0 * view.radius,
            cell_size=cell,
            section_size=5.0 * cell,
            cell_color=(205, 208, 214),
            section_color=(150, 154, 162),
            fade_distance=12.0 * view.radius,
            shadow_opacity=0.2,
            wxyz=turning_z_to(up),
            position=tuple(place),
        )
        self.nodes = [grid]

    def update(self, moment: Moment) -> None:
        """The grid does not change."""


def _corners(low: np.ndarray, high: np.ndarray) -> list[np.ndarray]:
    return [np.where([a, b, c], low, high) for a in (0, 1) for b in (0, 1) for c in (0, 1)]
