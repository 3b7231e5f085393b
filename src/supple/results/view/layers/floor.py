"""The floor: a grid, which shows its position and the scale, and soft shadows, which show where bodies touch it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from supple.results.view.floor_shadow import floor_shadow
from supple.results.view.layers.layer import Layer, quaternion, turning_z_to
from supple.results.view.model import Moment
from supple.results.view.surfaces import body_surface, boundary_surface, obstacle_surfaces


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


_CELLS = 128  # a picture of so many is made in some milliseconds


class ShadowView(Layer):
    """A picture on the floor; nothing where the scene has no floor."""

    def __init__(self, scene: Any, moment: Moment) -> None:
        model, self.nodes = moment.model, []
        self._shadow = floor_shadow(model, _CELLS)
        if self._shadow is None:
            return
        # The boundary of the tets casts the shadow of a skin: it has fewer triangles.
        bodies = [body_surface(model, body) if body.rigid else boundary_surface(body) for body in model.bodies]
        self._casting = [one for one in (*bodies, *obstacle_surfaces(model)) if one.casts_shadow]
        corners = self._shadow.corners
        first, second = corners[1] - corners[0], corners[3] - corners[0]
        size = float(np.linalg.norm(first))
        axes = np.stack([first / size, second / size, np.cross(first, second) / size**2], axis=1)
        self._image = scene.add_image(
            "/shadow",
            self._picture(moment),
            size,
            size,
            format="png",
            cast_shadow=False,
            receive_shadow=False,
            wxyz=quaternion(axes),
            position=corners.mean(axis=0),
        )
        self.nodes = [self._image]

    def update(self, moment: Moment) -> None:
        if self.nodes:
            self._image.image = self._picture(moment)

    def _picture(self, moment: Moment) -> Any:
        assert self._shadow is not None
        return self._shadow.picture([(surface.at(moment), surface.triangles) for surface in self._casting])
