"""Contacts: a point, and the normal where it is known."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.viewer.drawing.layers.primitives.arrows import Arrows
from supple.viewer.drawing.layers.primitives.layer import Layer, single
from supple.viewer.drawing.moments.model import Moment

_COLOR = (220, 40, 110)


class ContactView(Layer):
    """A dot for each contact, and an arrow where the normal is known."""

    def __init__(self, scene: Any, moment: Moment) -> None:
        radius = moment.model.view.radius
        self._length = 0.15 * radius
        self._dots = scene.add_point_cloud(
            "/contacts/points",
            np.zeros((1, 3), dtype=np.float32),
            _COLOR,
            point_size=0.02 * radius,
            point_shape="circle",
            visible=False,
        )
        self._arrows = Arrows(scene, "/contacts/normals", _COLOR, 0.05 * radius)
        self.update(moment)

    def update(self, moment: Moment) -> None:
        points, normals = moment.contact_points, moment.contact_normals
        if points is None:
            points = np.zeros((0, 3))
        if len(points):
            self._dots.points = single(points)
        if self._dots.visible != bool(len(points)):
            self._dots.visible = bool(len(points))
        if normals is not None:
            self._arrows.update(points, points + self._length * normals)

    def remove(self) -> None:
        self._dots.remove()
        self._arrows.remove()


def contacts_text(moment: Moment) -> str:
    """Text for the panel."""
    if moment.contact_points is None:
        return "Contacts: not known."
    return f"Contacts: {len(moment.contact_points)}."
