"""A set of arrows that can change."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.viewer.drawing.layers.primitives.layer import single


class Arrows:
    """Arrows of one color.

    Parameters
    ----------
    scene : of viser; name : of the node; color : (r, g, b); size : length of a head [m]
    """

    def __init__(self, scene: Any, name: str, color: tuple[int, int, int], size: float) -> None:
        self._handle = scene.add_arrows(
            name,
            np.zeros((1, 2, 3)),
            color,
            shaft_radius=0.15 * size,
            head_radius=0.4 * size,
            head_length=size,
            visible=False,
        )

    def update(self, start: NDArray[np.float64], end: NDArray[np.float64]) -> None:
        """Draw arrows between points (k, 3) [m]; those of length zero are not drawn."""
        some = np.linalg.norm(end - start, axis=1) > 0.0
        if some.any():
            self._handle.points = single(np.stack([start[some], end[some]], axis=1))
        if bool(some.any()) != self._handle.visible:
            self._handle.visible = bool(some.any())

    def remove(self) -> None:
        """Remove them from the page."""
        self._handle.remove()
