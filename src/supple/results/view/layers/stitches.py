"""Stitches: from each stitched vertex to the point that was nearest to it at the start."""

from __future__ import annotations

from typing import Any

from supple.results.view.layers.layer import Layer, single
from supple.results.view.model import Moment


class StitchView(Layer):
    """A line for each stitch."""

    def __init__(self, scene: Any, moment: Moment) -> None:
        self.nodes = []
        if len(moment.stitch_segments):
            handle = scene.add_line_segments(
                "/stitches", single(moment.stitch_segments), (30, 30, 34), thickness=2.5, thickness_units="screen"
            )
            self.nodes = [handle]

    def update(self, moment: Moment) -> None:
        for handle in self.nodes:
            handle.points = single(moment.stitch_segments)
