"""Grabs of visitors, as springs with their length, and the pusher."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.viewer.drawing.layers.primitives.layer import Layer, single
from supple.viewer.drawing.moments.model import Moment

_SPRING_COLOR, _PUSHER_COLOR = (20, 150, 70), (120, 90, 200)


class SpringView(Layer):
    """A line for each spring, and a label with its length."""

    def __init__(self, scene: Any, moment: Moment) -> None:
        self._scene = scene
        self._lines: Any = None
        self._labels: dict[int, Any] = {}
        self.update(moment)

    def update(self, moment: Moment) -> None:
        springs = moment.springs
        self._draw_lines(moment)
        for gone in set(self._labels) - set(springs):
            self._labels.pop(gone).remove()
        for number, (point, target) in springs.items():
            text = length_text(float(np.linalg.norm(target - point)))
            middle = tuple(0.5 * (point + target))
            label = self._labels.get(number)
            if label is None:
                self._labels[number] = self._scene.add_label(f"/springs/{number}", text, position=middle)
                continue
            label.position = middle
            if label.text != text:
                label.text = text

    def _draw_lines(self, moment: Moment) -> None:
        ends = [np.stack(pair) for pair in moment.springs.values()]
        if ends and self._lines is None:
            self._lines = self._scene.add_line_segments(
                "/springs/lines", single(np.stack(ends)), _SPRING_COLOR, thickness=5.0, thickness_units="screen"
            )
        elif ends:
            self._lines.points = single(np.stack(ends))
        if self._lines is not None and self._lines.visible != bool(ends):
            self._lines.visible = bool(ends)

    def remove(self) -> None:
        for label in self._labels.values():
            label.remove()
        if self._lines is not None:
            self._lines.remove()


class PusherView(Layer):
    """The ball of the pusher."""

    def __init__(self, scene: Any, moment: Moment) -> None:
        self._ball = scene.add_icosphere(
            "/pusher", radius=1.0, color=_PUSHER_COLOR, opacity=0.85, subdivisions=4, visible=False
        )
        self.update(moment)

    def update(self, moment: Moment) -> None:
        if moment.pusher is not None:
            center, radius = moment.pusher
            self._ball.position = tuple(center)
            if self._ball.radius != radius:
                self._ball.radius = radius
        if self._ball.visible != (moment.pusher is not None):
            self._ball.visible = moment.pusher is not None

    def remove(self) -> None:
        self._ball.remove()


def length_text(meters: float) -> str:
    """A length in m, cm or mm."""
    if meters >= 1.0:
        return f"{meters:.2f} m"
    return f"{100.0 * meters:.1f} cm" if meters >= 0.01 else f"{1000.0 * meters:.1f} mm"
