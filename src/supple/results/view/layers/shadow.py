"""Soft shadows on the floor, which show where bodies touch it."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.results.view.floor_shadow import floor_shadow
from supple.results.view.layers.layer import Layer
from supple.results.view.layers.rotation import quaternion
from supple.results.view.model import Moment
from supple.results.view.surfaces import body_surface, boundary_surface, obstacle_surfaces

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
