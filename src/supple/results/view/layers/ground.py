"""A grid on the floor, which shows its position and the scale."""

from __future__ import annotations

import math
from typing import Any

from supple.results.view.layers.layer import Layer
from supple.results.view.layers.rotation import turning_z_to
from supple.results.view.model import Moment


class Ground(Layer):
    """Lines on the highest floor; none where the scene has no floor, because a grid would look like one."""

    def __init__(self, scene: Any, moment: Moment) -> None:
        model = moment.model
        view, up = model.view, model.view.up
        planes = [one.obstacle.plane for one in model.obstacles]
        floors = [plane[0] for plane in planes if plane is not None and float(plane[1] @ up) > 0.99]
        self.nodes = []
        if not floors:
            return
        height = max(float(point @ up) for point in floors)
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
