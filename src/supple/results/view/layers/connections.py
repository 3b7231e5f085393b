"""Springs of grabs with their length, and a line for each stitch."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.results.view.layers.layer import Layer, single
from supple.results.view.model import RenderFrame

STITCH_COLOR = (30, 30, 34)
_SPRING_COLOR = (20, 150, 70)


class SpringView(Layer):
    """A line for each spring, and a label with its length."""

    def __init__(self, scene: Any, frame: RenderFrame) -> None:
        self._scene = scene
        self._lines = scene.add_line_segments(
            "/springs/lines",
            np.zeros((1, 2, 3), dtype=np.float32),
            _SPRING_COLOR,
            thickness=5.0,
            thickness_units="screen",
            visible=False,
        )
        self._labels: dict[int, Any] = {}
        self.update(frame)

    def update(self, frame: RenderFrame) -> None:
        springs = frame.springs
        self._lines.visible = bool(springs)
        if springs:
            self._lines.points = single(np.array(list(springs.values())))
        for gone in set(self._labels) - set(springs):
            self._labels.pop(gone).remove()
        for number, (point, target) in springs.items():
            text = length_text(float(np.linalg.norm(target - point)))
            middle = tuple(0.5 * (point + target))
            if number in self._labels:
                self._labels[number].position, self._labels[number].text = middle, text
            else:
                self._labels[number] = self._scene.add_label(f"/springs/{number}", text, position=middle)

    def remove(self) -> None:
        for node in (self._lines, *self._labels.values()):
            node.remove()


def length_text(meters: float) -> str:
    """A length in m, cm or mm."""
    if meters >= 1.0:
        return f"{meters:.2f} m"
    return f"{100.0 * meters:.1f} cm" if meters >= 0.01 else f"{1000.0 * meters:.1f} mm"


class StitchView(Layer):
    """A line for each stitch."""

    def __init__(self, scene: Any, frame: RenderFrame) -> None:
        self.nodes = []
        if len(frame.stitch_segments):
            handle = scene.add_line_segments(
                "/stitches", single(frame.stitch_segments), STITCH_COLOR, thickness=2.5, thickness_units="screen"
            )
            self.nodes = [handle]

    def update(self, frame: RenderFrame) -> None:
        for handle in self.nodes:
            handle.points = single(frame.stitch_segments)
