"""Points of a frame as dots, such as pinned vertices and contacts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.results.view.layers.layer import Layer, single
from supple.results.view.model import RenderFrame


class Dots(Layer):
    """A dot for each point.

    Parameters
    ----------
    name : of the node; size : of a dot, as a share of the size of the scene
    points : returns those of a frame, (k, 3) [m]
    """

    def __init__(
        self,
        scene: Any,
        frame: RenderFrame,
        name: str,
        color: tuple[int, int, int],
        size: float,
        points: Callable[[RenderFrame], NDArray[np.float64]],
    ) -> None:
        self._points = points
        self._dots = scene.add_point_cloud(
            name,
            np.zeros((1, 3), dtype=np.float32),
            color,
            point_size=size * frame.model.view.radius,
            point_shape="circle",
            visible=False,
        )
        self.nodes = [self._dots]
        self.update(frame)

    def update(self, frame: RenderFrame) -> None:
        points = self._points(frame)
        self._dots.visible = len(points) > 0
        if len(points):
            self._dots.points = single(points)
